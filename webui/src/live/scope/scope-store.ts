import type { ScopeStart } from '../../api/schema'
import { decodeBlocks, type ScopeBlock } from './blocks'
import { columns } from './decimate'
import { MathsChannel } from './analysis/maths'
import { measure, stretch } from './analysis/measure'
import { Ring, Trace } from './ring'
import { csv, overlays, xy } from './scope-answers'
import { ScopeSweeps } from './scope-sweeps'
import { EVEN, spectrogram, spectrum } from './analysis/spectrum'
import type {
  Losses,
  QuestionKind,
  Questions,
  ScopeConfig,
  ScopeFrame,
  ScopeTrigger,
  ScopeView,
  TriggerState,
} from '../worker/worker-messages'

/** Rows kept per channel: at 4 kHz 80 s, and 16 channels of it take 82 MB. */
const GREATEST_ROWS = 320_000

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
  private readonly sweeps: ScopeSweeps
  /** A single picture was caught whole: nothing more is taken, so that it stays however long. */
  private held = false
  private count = 0
  private period = 0

  constructor(private readonly ports: Ports) {
    this.sweeps = new ScopeSweeps((state) => {
      ports.triggered(state)
    })
  }

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
    // A number of its own, so that blocks of the earlier choice are not mistaken for these.
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

  private compute(wanted: ScopeConfig['maths'], newly: boolean): void {
    const old = newly ? [] : this.maths
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
    this.sweeps.forget()
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
    this.sweeps.look((id) => this.find(id))
    this.held ||= this.sweeps.caught(this.newest(), this.rings.values())
  }

  private take(drive: string, subscription: Subscription, block: ScopeBlock): void {
    const before = subscription.sequences.get(block.stream)
    if (before !== undefined && block.sequence > before + 1) {
      this.losses.blocks += block.sequence - before - 1
    }
    // A sequence that begins again is of another stream, with perhaps other channels.
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

  /** Arm; null looks for none. Arming again begins a new search from now on. */
  setTrigger(trigger: ScopeTrigger | null): void {
    this.held = false
    this.sweeps.arm(trigger, this.newest() ?? 0, trigger && this.find(trigger.id)?.ring)
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
      csv: ({ ids, names, from, to, origin }) =>
        csv(
          ids.map((id) => this.found(id)),
          names,
          { from, to, origin },
        ),
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
      xy: ({ x, y, from, to, most }) => xy(this.found(x), stretch(this.found(y), from, to), most),
    }
    return answers[what](ask)
  }

  private found(id: string): Trace {
    return this.find(id) ?? new Trace(new Ring(0))
  }

  private frame(view: ScopeView): ScopeFrame {
    const newest = this.newest()
    const { from, to } = 'from' in view.show ? view.show : this.sweeps.shown(view.show, newest)
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
      trigger: this.sweeps.state(newest),
      overlays: view.persistence ? overlays(this.sweeps.earlier, traces, view.bins) : [],
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
