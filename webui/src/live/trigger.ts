import type { Trace } from './decimate'

export interface TriggerSettings {
  kind: 'rising' | 'falling' | 'above' | 'below'
  level: number
  /** Seconds shown, and the part of them before the trigger (0 to 1). */
  window: number
  before: number
}

/** Looks for the trigger in samples as they arrive, and says which stretch to show. */
export class Trigger {
  private previous: number | null = null
  private seenUntil: number
  /** Time of the trigger whose stretch is not complete yet. */
  private pending: number | null = null

  constructor(
    readonly settings: TriggerSettings,
    since: number,
  ) {
    this.seenUntil = since
  }

  /** The stretch [from, to] that has been completed by now, or null. */
  look({ ring, channel }: Trace): [number, number] | null {
    const { window, before } = this.settings
    if (this.pending === null) {
      for (let row = ring.firstAt(this.seenUntil); row < ring.length; row++) {
        const time = ring.time(row)
        if (time <= this.seenUntil && this.previous !== null) continue
        const value = ring.value(row, channel)
        this.seenUntil = time
        if (!Number.isFinite(value)) continue
        const fired = this.fires(value)
        this.previous = value
        if (fired) {
          this.pending = time
          break
        }
      }
    }
    if (this.pending === null) return null
    const from = this.pending - window * before
    const to = from + window
    if ((ring.newest ?? 0) < to) return null
    this.pending = null
    this.previous = null // the next trigger needs a crossing of its own
    this.seenUntil = to
    return [from, to]
  }

  private fires(value: number): boolean {
    const { kind, level } = this.settings
    if (kind === 'above') return value > level
    if (kind === 'below') return value < level
    if (this.previous === null) return false
    return kind === 'rising'
      ? this.previous < level && value >= level
      : this.previous > level && value <= level
  }
}
