import type { ScopeStart } from '../api/schema'
import { decodeBlocks, type ScopeBlock } from './blocks'
import { columns, thinned } from './decimate'
import { MathsChannel } from './maths'
import { measure, stretch } from './measure'
import { Ring, Trace } from './ring'
import { EVEN, spectrogram, spectrum } from './spectrum'
import { type Sweep, Trigger } from './trigger'
import type {
  Losses,
  Overlay,
  QuestionKind,
  Questions,
  ScopeConfig,
  ScopeFrame,
  ScopeTrigger,
  ScopeView,
  TriggerState,
} from './worker-messages'

/** Rows kept per channel: at 4 kHz 80 s, and 16 channels of it take 82 MB. */
const GREATEST_ROWS = 320_000
const MOST_SWEEPS = 50
/** Traces that lag by more than this are not waited for when a single picture is complete. */
const LAG_S = 1
/** With no trigger for so long the automatic mode shows what there is. */
const AUTO_S = 0.5

interface Subscription {
  number: number
  keys: string[]
  rings: Ring[]
  sequences: Map<number, number>
  /** Stream that brought a channel last, and whether with every cycle. */
  source: ({ stream: number; synchronous: boolean } | undefined)[]
  /** A new connection: what passed meanwhile is to be counted. */
  resumed: boolean
}

interface Ports {
  /** A standing request, or its end. */
  start(message: ScopeStart): void
  stop(subscription: number): void
  /** These are the subscriptions that there are now. */
  changed(subscriptions: number[]): void
  /** What the trigger is up to, whenever that changes. */
  triggered(state: TriggerState): void
  /** Seconds on the clock of this computer. */
  now(): number
}

const named = (drive: string, key: string) => `${drive} ${key}`

/** All that the worker keeps of the scope. */
export class ScopeStore {
  private readonly rings = new Map<string, { ring: Ring; heard: number | null }>()
  private readonly subscriptions = new Map<string, Subscription>()
  private traces = new Map<string, Trace>()
  private maths: { id: string; expression: string; channel: MathsChannel }[] = []
  private readonly losses: Losses = { dropped: 0, blocks: 0, away: 0 }
  private finder: { trigger: ScopeTrigger; search: Trigger } | null = null
  private sweeps: Sweep[] = []
  private sweepCount = 0
  private armedAt = 0
  /** A single picture was caught whole: nothing more is taken, so that it stays however long. */
  private held = false
  private told: TriggerState = 'off'
  private count = 0
  private period = 0

  constructor(private readonly ports: Ports) {}

  // --- what is sampled ----------------------------------------------------------------

  configure(config: ScopeConfig): void {
    const wanted = new Map<string, string[]>()
    for (const { drive, key } of config.sources) {
      const keys = wanted.get(drive) ?? []
      if (!keys.includes(key)) wanted.set(drive, [...keys, key])
    }
    const keep = new Set(config.sources.map(({ drive, key }) => named(drive, key)))
    for (const name of this.rings.keys()) if (!keep.has(name)) this.rings.delete(name)
    for (const [drive, subscription] of this.subscriptions) {
      if (wanted.has(drive)) continue
      this.ports.stop(subscription.number)
      this.subscriptions.delete(drive)
    }
    for (const [drive, keys] of wanted) this.subscribe(drive, keys, config.period)
    this.period = config.period
    this.ports.changed([...this.subscriptions.values()].map((each) => each.number))
    const before = JSON.stringify([...this.traces].map(([id, t]) => [id, t.factor, t.offset]))
    this.traces = new Map(
      config.sources.map(({ id, drive, key, factor, offset }) => [
        id,
        new Trace(this.ring(named(drive, key)), factor, offset),
      ]),
    )
    const now = JSON.stringify([...this.traces].map(([id, t]) => [id, t.factor, t.offset]))
    this.compute(config.maths, before !== now)
    if (config.sources.length === 0) this.forget()
  }

  private subscribe(drive: string, keys: string[], period: number): void {
    const old = this.subscriptions.get(drive)
    if (old && old.keys.join() === keys.join() && period === this.period) return
    this.held = false
    // A number of its own, so that blocks of the earlier choice are not taken for these.
    const number = ++this.count
    if (old) this.ports.stop(old.number)
    this.subscriptions.set(drive, {
      number,
      keys,
      rings: keys.map((key) => this.ring(named(drive, key))),
      sequences: new Map(),
      source: [],
      resumed: false,
    })
    this.ports.start({
      type: 'scope_start',
      subscription: number,
      channels: keys.map((key) => ({ drive, key })),
      period_s: period,
    })
  }

  private ring(name: string): Ring {
    let found = this.rings.get(name)
    if (!found) {
      found = { ring: new Ring(GREATEST_ROWS), heard: null }
      this.rings.set(name, found)
    }
    return found.ring
  }

  private compute(wanted: ScopeConfig['maths'], anew: boolean): void {
    const old = anew ? [] : this.maths
    this.maths = []
    for (const { id, expression } of wanted) {
      const kept = old.find((each) => each.id === id && each.expression === expression)
      // Only those before it in the list, so that none depends on itself.
      const before = this.maths.map((each) => each.id)
      const find = (name: string) =>
        name.startsWith('m') && !before.includes(name) ? null : this.find(name)
      try {
        const channel = kept?.channel ?? new MathsChannel(expression, GREATEST_ROWS, find)
        channel.advance()
        this.maths.push({ id, expression, channel })
      } catch {
        // The page parses it too and says what is wrong; there is just no trace.
      }
    }
  }

  private find(id: string): Trace | null {
    return this.traces.get(id) ?? this.maths.find((each) => each.id === id)?.channel.trace ?? null
  }

  private forget(): void {
    this.losses.dropped = this.losses.blocks = this.losses.away = 0
    this.sweeps = []
    this.sweepCount = 0
  }

  clear(): void {
    for (const { ring } of this.rings.values()) ring.clear()
    this.compute(
      this.maths.map(({ id, expression }) => ({ id, expression })),
      true,
    )
    this.forget()
  }

  /** The connection is gone; the next blocks come after a gap. */
  interrupted(): void {
    for (const subscription of this.subscriptions.values()) {
      subscription.resumed = true
      subscription.sequences.clear()
    }
  }

  // --- samples ------------------------------------------------------------------------

  block(data: ArrayBuffer): void {
    for (const block of decodeBlocks(data)) {
      for (const [drive, subscription] of this.subscriptions) {
        if (subscription.number !== block.subscription) continue
        this.take(drive, subscription, block)
      }
    }
    for (const { channel } of this.maths) channel.advance()
    this.look()
    this.held ||= this.caught()
  }

  /** Whether the one picture that was wanted is there, of all traces that bring anything. */
  private caught(): boolean {
    const [sweep] = this.sweeps
    if (this.finder?.trigger.mode !== 'single' || !sweep) return false
    if ((this.newest() ?? 0) > sweep.to + LAG_S) return true
    return [...this.rings.values()].every(
      ({ ring }) => ring.newest === null || ring.newest >= sweep.to,
    )
  }

  private take(drive: string, subscription: Subscription, block: ScopeBlock): void {
    const before = subscription.sequences.get(block.stream)
    if (before !== undefined && block.sequence > before + 1) {
      this.losses.blocks += block.sequence - before - 1
    }
    // A sequence that begins anew is of another stream, with perhaps other channels.
    if (before !== undefined && block.sequence <= before) subscription.source = []
    subscription.sequences.set(block.stream, block.sequence)
    this.losses.dropped += block.dropped
    const now = this.ports.now()
    if (this.held) {
      for (const key of subscription.keys) this.heard(named(drive, key), now)
      return
    }
    let away = 0
    for (const [k, ring] of subscription.rings.entries()) {
      const source = subscription.source[k]
      if (source?.stream !== block.stream && !hasValue(block, k)) continue
      if (subscription.resumed && source?.synchronous && block.spacing && ring.newest !== null) {
        const gap = (block.times[0] as number) - ring.newest
        away = Math.max(away, Math.round(gap / block.spacing) - 1)
      }
      subscription.source[k] = { stream: block.stream, synchronous: block.spacing !== null }
      for (let row = 0; row < block.rows; row++) {
        ring.push(block.times[row] as number, block.samples[row * block.channels + k] as number)
      }
      this.heard(named(drive, subscription.keys[k] as string), now)
    }
    if (subscription.resumed && block.spacing !== null) {
      this.losses.away += away
      subscription.resumed = false
    }
  }

  private heard(name: string, now: number): void {
    const place = this.rings.get(name)
    if (place) place.heard = now
  }

  // --- trigger ------------------------------------------------------------------------

  /** Arm; null looks for none. Arming again begins a new search from now on. */
  setTrigger(trigger: ScopeTrigger | null): void {
    this.sweeps = []
    this.sweepCount = 0
    this.held = false
    this.armedAt = this.newest() ?? 0
    const ring = trigger && this.find(trigger.id)?.ring
    this.finder = trigger && {
      trigger,
      search: new Trigger(trigger.settings, ring?.newest ?? this.armedAt, ring?.begun),
    }
    this.tell()
  }

  private look(): void {
    if (!this.finder) return
    const { trigger, search } = this.finder
    const trace = this.find(trigger.id)
    if (!trace || (trigger.mode === 'single' && this.sweeps.length > 0)) return
    for (let found = search.look(trace); found; found = search.look(trace)) {
      this.sweeps.push(found)
      this.sweepCount++
      if (trigger.mode === 'single') break
    }
    this.sweeps = this.sweeps.slice(-Math.min(MOST_SWEEPS, trigger.persistence + 1))
    this.tell()
  }

  private tell(): void {
    const state = !this.finder ? 'off' : this.sweeps.length === 0 ? 'waiting' : 'triggered'
    if (state !== this.told) this.ports.triggered(state)
    this.told = state
  }

  private newest(): number | null {
    let newest: number | null = null
    for (const { ring } of this.rings.values()) {
      if (ring.newest !== null && (newest === null || ring.newest > newest)) newest = ring.newest
    }
    return newest
  }

  // --- answers ------------------------------------------------------------------------

  answer<Kind extends QuestionKind>(
    what: Kind,
    ask: Questions[Kind]['ask'],
  ): Questions[Kind]['get'] {
    const answers: { [K in QuestionKind]: (ask: Questions[K]['ask']) => Questions[K]['get'] } = {
      view: (view) => this.frame(view),
      csv: ({ ids, names, from, to, origin }) => this.csv(ids, names, from, to, origin),
      samples: ({ ids, from, to }) =>
        ids
          .map((id) => stretch(this.found(id), from, to))
          .map(({ times, values }) => ({
            times: times.slice(),
            values: values.slice(),
          })),
      spectrum: ({ id, from, to, window, synchronous }) => {
        const { times, values } = stretch(this.found(id), from, to)
        return spectrum(times, values, window, EVEN[synchronous ? 'synchronous' : 'polled'])
      },
      spectrogram: ({ id, from, to, columns: wide, synchronous }) => {
        const { times, values } = stretch(this.found(id), from, to)
        return spectrogram(times, values, wide, EVEN[synchronous ? 'synchronous' : 'polled'])
      },
      xy: ({ x, y, from, to, most }) => this.xy(x, y, from, to, most),
    }
    return answers[what](ask)
  }

  private found(id: string): Trace {
    return this.find(id) ?? new Trace(new Ring(0))
  }

  private frame(view: ScopeView): ScopeFrame {
    const newest = this.newest()
    const { from, to } = this.stretch(view, newest)
    // A picture that stands is not to crumble while somebody talks about it.
    for (const { ring } of this.rings.values()) {
      ring.keep = 'from' in view.show ? Math.min(ring.keep, from) : Number.POSITIVE_INFINITY
    }
    const traces = view.ids.map((id) => this.found(id))
    const over = view.measure === 'shown' ? { from, to } : view.measure
    const now = this.ports.now()
    return {
      columns: columns(traces, from, to, view.bins),
      from,
      to,
      newest,
      trigger: this.triggered(newest),
      overlays: view.persistence ? this.overlays(traces, view.bins) : [],
      measurements: over && traces.map((trace) => measure(trace, over.from, over.to)),
      cursorValues: view.cursors.map((time) => traces.map((trace) => trace.at(time))),
      losses: { ...this.losses },
      rates: traces.map(({ ring }) => rate(ring)),
      ages: traces.map(({ ring }) =>
        ring.newest === null || newest === null ? null : newest - ring.newest,
      ),
      silent: traces.map(({ ring }) => {
        const place = [...this.rings.values()].find((each) => each.ring === ring)
        return place?.heard == null ? null : now - place.heard
      }),
    }
  }

  private triggered(newest: number | null): ScopeFrame['trigger'] {
    const at = this.sweeps.at(-1)?.at ?? null
    const count = this.sweepCount
    if (!this.finder) return { state: 'off', at: null, count }
    if (this.free(newest)) return { state: 'auto', at: null, count }
    return { state: at === null ? 'waiting' : 'triggered', at, count }
  }

  /** Whether the automatic mode shows what there is, for want of a trigger. */
  private free(newest: number | null): boolean {
    if (this.finder?.trigger.mode !== 'auto' || newest === null) return false
    const last = this.sweeps.at(-1)?.to ?? this.armedAt
    // Earlier than the last one: the clock is another one since.
    return newest < last || newest - last > Math.max(AUTO_S, this.finder.trigger.settings.window)
  }

  private stretch(view: ScopeView, newest: number | null): { from: number; to: number } {
    if ('from' in view.show) return view.show
    const end = newest ?? 0
    if ('window' in view.show) return { from: end - view.show.window, to: end }
    const window = this.finder?.trigger.settings.window ?? 1
    if (this.free(newest)) return { from: end - window, to: end }
    // Until the first trigger: what would lie before it if it came now.
    const before = window * (this.finder?.trigger.settings.before ?? 0)
    return this.sweeps.at(-1) ?? { from: end - before, to: end - before + window }
  }

  /** Sweeps before the newest one, oldest first. */
  private overlays(traces: Trace[], bins: number): Overlay[] {
    return this.sweeps.slice(0, -1).flatMap((sweep) => {
      const [times, ...series] = columns(traces, sweep.from, sweep.to, bins)
      return series.map((values, trace) => {
        const shown = Array.from(times, (_, i) => i).filter((i) => values[i] != null)
        return {
          trace,
          times: shown.map((i) => (times[i] as number) - sweep.at),
          values: shown.map((i) => values[i] as number),
        }
      })
    })
  }

  /** Raw samples as CSV: one row per time, empty where a trace has no sample then. */
  private csv(ids: string[], names: string[], from: number, to: number, origin: number): string {
    const traces = ids.map((id) => this.found(id))
    const [times, ...series] = columns(traces, from, to, Number.MAX_SAFE_INTEGER)
    const quoted = ['time_s', ...names].map((name) => `"${name.replaceAll('"', '""')}"`)
    const lines = [quoted.join(',')]
    for (let i = 0; i < times.length; i++) {
      const values = series.map((column) => column[i] ?? '')
      lines.push([((times[i] as number) - origin).toFixed(6), ...values].join(','))
    }
    return `${lines.join('\r\n')}\r\n`
  }

  /** One channel over another, at the times of the first; the extremes of both are kept. */
  private xy(x: string, y: string, from: number, to: number, most: number) {
    const [over, of] = [this.found(x), stretch(this.found(y), from, to)]
    const across = Float64Array.from(of.times, (time) => over.between(time))
    const kept = new Set([
      ...thinned(of.times, of.values, most / 2).times,
      ...thinned(of.times, across, most / 2).times,
    ])
    const points: Questions['xy']['get'] = { x: [], y: [], times: [] }
    for (let i = 0; i < of.times.length; i++) {
      const [px, py] = [across[i] as number, of.values[i] as number]
      if (!kept.has(of.times[i] as number) || !Number.isFinite(px)) continue
      points.x.push(px)
      points.y.push(py)
      points.times.push(of.times[i] as number)
    }
    return points
  }
}

/** A column without any value is of another stream, or not valid throughout. */
function hasValue(block: ScopeBlock, column: number): boolean {
  for (let row = 0; row < block.rows; row++) {
    if (!Number.isNaN(block.samples[row * block.channels + column])) return true
  }
  return false
}

function rate(ring: Ring): number | null {
  const rows = Math.min(ring.length, 200)
  if (rows < 2) return null
  const span = ring.time(ring.length - 1) - ring.time(ring.length - rows)
  return span > 0 ? (rows - 1) / span : null
}
