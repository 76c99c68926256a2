import { decodeBlock } from './blocks'
import { columns, type Trace } from './decimate'
import { measure, valueAt } from './measure'
import { Ring } from './ring'
import { Trigger, type TriggerSettings } from './trigger'
import type { ScopeFrame, ScopeView, TraceRef } from './worker-messages'

/** Values kept per subscription: 16 channels at 4 kHz for a minute and a half in 25 MB. */
const GREATEST_VALUES = 6_000_000
const GREATEST_ROWS = 400_000

/** All that the worker keeps of the scope. */
export class ScopeStore {
  private readonly rings = new Map<number, Ring>()
  private trigger: { trace: TraceRef; finder: Trigger } | null = null
  private triggered: [number, number] | null = null
  private triggeredAt: number | null = null

  add(subscription: number, channels: number): void {
    const rows = Math.min(GREATEST_ROWS, Math.floor(GREATEST_VALUES / channels))
    this.rings.set(subscription, new Ring(channels, rows))
  }

  remove(subscription: number): void {
    this.rings.delete(subscription)
  }

  clear(): void {
    for (const ring of this.rings.values()) ring.clear()
    this.triggered = null
    this.triggeredAt = null
  }

  block(data: ArrayBuffer): void {
    const block = decodeBlock(data)
    this.rings.get(block.subscription)?.push(block)
    this.look()
  }

  setTrigger(trace: TraceRef | null, settings: TriggerSettings | null): void {
    this.triggered = null
    this.triggeredAt = null
    this.trigger =
      trace && settings ? { trace, finder: new Trigger(settings, this.newest() ?? 0) } : null
  }

  private look(): void {
    const trace = this.trigger && this.find(this.trigger.trace)
    if (!this.trigger || !trace) return
    const found = this.trigger.finder.look(trace)
    if (found) {
      this.triggered = found
      const { window, before } = this.trigger.finder.settings
      this.triggeredAt = found[0] + window * before
    }
  }

  private find({ subscription, channel }: TraceRef): Trace | null {
    const ring = this.rings.get(subscription)
    return ring && channel < ring.channels ? { ring, channel } : null
  }

  private newest(): number | null {
    let newest: number | null = null
    for (const ring of this.rings.values()) {
      if (ring.newest !== null && (newest === null || ring.newest > newest)) newest = ring.newest
    }
    return newest
  }

  frame(view: ScopeView): ScopeFrame {
    const newest = this.newest()
    const [from, to] = this.stretch(view, newest)
    const missing = new Ring(1, 1)
    const traces = view.traces.map((ref) => this.find(ref) ?? { ring: missing, channel: 0 })
    const rings = new Set(traces.map((trace) => trace.ring))
    const stretch = view.measure ?? { from, to }
    return {
      columns: columns(traces, from, to, view.bins),
      from,
      to,
      newest,
      triggeredAt: this.triggeredAt,
      measurements: traces.map((trace) => measure(trace, stretch.from, stretch.to)),
      cursorValues: view.cursors.map((time) => traces.map((trace) => valueAt(trace, time))),
      dropped: [...rings].reduce((sum, ring) => sum + ring.dropped, 0),
      lostBlocks: [...rings].reduce((sum, ring) => sum + ring.lostBlocks, 0),
      rates: traces.map(({ ring }) => rate(ring)),
      ages: traces.map(({ ring }) =>
        ring.newest === null || newest === null ? null : newest - ring.newest,
      ),
    }
  }

  private stretch(view: ScopeView, newest: number | null): [number, number] {
    if ('from' in view.show) return [view.show.from, view.show.to]
    const end = newest ?? 0
    if ('window' in view.show) return [end - view.show.window, end]
    return this.triggered ?? [0, 0]
  }

  /** Raw samples as CSV: one row per time, empty where a trace has no sample then. */
  csv(refs: TraceRef[], names: string[], from: number, to: number): string {
    const traces = refs.flatMap((ref) => this.find(ref) ?? [])
    const [times, ...series] = columns(traces, from, to, Number.MAX_SAFE_INTEGER)
    const origin = times[0] ?? 0
    const quoted = ['time_s', ...names].map((name) => `"${name.replaceAll('"', '""')}"`)
    const lines = [quoted.join(',')]
    for (let i = 0; i < times.length; i++) {
      const values = series.map((column) => column[i] ?? '')
      lines.push([((times[i] as number) - origin).toFixed(6), ...values].join(','))
    }
    return `${lines.join('\r\n')}\r\n`
  }
}

function rate(ring: Ring): number | null {
  const rows = Math.min(ring.length, 200)
  if (rows < 2) return null
  const span = ring.time(ring.length - 1) - ring.time(ring.length - rows)
  return span > 0 ? (rows - 1) / span : null
}
