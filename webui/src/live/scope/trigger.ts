import type { Trace } from './ring'

export interface TriggerSettings {
  /**
   * Edges through `level`; on one side of it; into or out of `level`…`high`; a bit of an integer;
   * any change; `motion`: the magnitude rises through it.
   */
  kind:
    | 'rising'
    | 'falling'
    | 'either'
    | 'above'
    | 'below'
    | 'enters'
    | 'leaves'
    | 'bit_set'
    | 'bit_clear'
    | 'change'
    | 'motion'
  level: number
  high: number
  bit: number
  /** Seconds shown, and the part of them before the trigger (0 to 1). */
  window: number
  before: number
}

/** A trigger and the stretch around it. */
export interface Sweep {
  from: number
  to: number
  at: number
}

/** Looks for the trigger in samples as they arrive, and says which stretch to show. */
export class Trigger {
  private previous: { time: number; value: number } | null = null
  private seenUntil: number
  /** Time of the trigger whose stretch is not complete yet. */
  private pending: number | null = null

  constructor(
    readonly settings: TriggerSettings,
    since: number,
    /** Of the ring that is looked at, when this was armed. */
    private begun = 0,
  ) {
    this.seenUntil = since
  }

  /** A trigger whose stretch has been completed by now, or null. */
  look(trace: Trace): Sweep | null {
    const { window, before } = this.settings
    if (trace.ring.begun !== this.begun) {
      // Its clock is another one: all that it holds came after this was armed.
      this.begun = trace.ring.begun
      this.seenUntil = Number.NEGATIVE_INFINITY
      this.previous = this.pending = null
    }
    if (this.pending === null) this.search(trace)
    if (this.pending === null) return null
    const from = this.pending - window * before
    const to = from + window
    if ((trace.ring.newest ?? 0) < to) return null
    const at = this.pending
    this.pending = null
    this.previous = null // the next trigger needs a crossing of its own
    this.seenUntil = to
    return { from, to, at }
  }

  private search(trace: Trace): void {
    const { ring } = trace
    for (let row = ring.firstAfter(this.seenUntil); row < ring.length; row++) {
      const now = { time: ring.time(row), value: trace.value(row) }
      this.seenUntil = now.time
      if (!Number.isFinite(now.value)) continue
      const before = this.previous
      this.previous = now
      this.pending = this.fires(before, now)
      if (this.pending !== null) return
    }
  }

  /** Time of the trigger between two samples, or null. */
  private fires(
    before: { time: number; value: number } | null,
    now: { time: number; value: number },
  ): number | null {
    const { kind, level, high, bit } = this.settings
    if (kind === 'above') return now.value > level ? now.time : null
    if (kind === 'below') return now.value < level ? now.time : null
    if (before === null) return null
    const through = (x0: number, x1: number, at: number) =>
      before.time + ((at - x0) / (x1 - x0)) * (now.time - before.time)
    const rises = (at: number) => before.value < at && now.value >= at
    const falls = (at: number) => before.value > at && now.value <= at
    const edge = (at: number) => through(before.value, now.value, at)
    const inside = (value: number) => value >= level && value <= high
    switch (kind) {
      case 'rising':
        return rises(level) ? edge(level) : null
      case 'falling':
        return falls(level) ? edge(level) : null
      case 'either':
        return rises(level) || falls(level) ? edge(level) : null
      case 'motion': {
        const [x0, x1] = [Math.abs(before.value), Math.abs(now.value)]
        return x0 < level && x1 >= level ? through(x0, x1, level) : null
      }
      case 'enters':
        if (inside(before.value) || !inside(now.value)) return null
        return edge(before.value < level ? level : high)
      case 'leaves':
        if (!inside(before.value) || inside(now.value)) return null
        return edge(now.value < level ? level : high)
      case 'bit_set':
        return !hasBit(before.value, bit) && hasBit(now.value, bit) ? now.time : null
      case 'bit_clear':
        return hasBit(before.value, bit) && !hasBit(now.value, bit) ? now.time : null
      case 'change':
        return before.value !== now.value ? now.time : null
    }
  }
}

/** Also of negative numbers, in two's complement, and beyond 31 bits. */
export function hasBit(value: number, bit: number): boolean {
  return Math.floor(value / 2 ** bit) % 2 !== 0
}
