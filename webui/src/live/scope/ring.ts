const FIRST_ROWS = 1024
/** Rows whose least and greatest value are kept together, so that long stretches draw fast. */
const CHUNK = 64

/**
 * The last samples of one channel with their times. Bounded: the oldest makes room for the newest.
 * Memory is allocated as it is needed, up to `capacity` rows.
 */
export class Ring {
  readonly capacity: number
  /** Rows from this time on are looked at: a full ring takes nothing in rather than let them go. */
  keep = Number.POSITIVE_INFINITY
  /** How often it began again: times before and after are of different clocks. */
  begun = 0
  private times = new Float64Array(FIRST_ROWS)
  private values = new Float64Array(FIRST_ROWS)
  private low: Float64Array
  private high: Float64Array
  /** Where the oldest row lies; the others follow, past the end from the beginning on. */
  private first = 0
  private used = 0

  constructor(capacity: number) {
    // A whole number of chunks, so that a chunk is never half of one lap and half of the next.
    this.capacity = Math.max(FIRST_ROWS, Math.ceil(capacity / CHUNK) * CHUNK)
    this.low = new Float64Array(FIRST_ROWS / CHUNK)
    this.high = new Float64Array(FIRST_ROWS / CHUNK)
  }

  get length(): number {
    return this.used
  }

  get newest(): number | null {
    return this.used === 0 ? null : this.time(this.used - 1)
  }

  /** Add a sample. A clock that went back (another computer) begins again. */
  push(time: number, value: number): void {
    if (this.used > 0 && time < this.time(this.used - 1)) this.clear()
    if (this.used === this.times.length) {
      if (this.times.length < this.capacity) this.grow()
      else if (this.time(0) >= this.keep) return
      else {
        if (++this.first === this.times.length) this.first = 0
        this.used--
      }
    }
    const at = this.place(this.used)
    this.times[at] = time
    this.values[at] = value
    const chunk = (at / CHUNK) | 0
    if (at % CHUNK === 0 || this.used === 0) {
      this.low[chunk] = Number.POSITIVE_INFINITY
      this.high[chunk] = Number.NEGATIVE_INFINITY
    }
    if (value < (this.low[chunk] as number)) this.low[chunk] = value
    if (value > (this.high[chunk] as number)) this.high[chunk] = value
    this.used++
  }

  time(row: number): number {
    return this.times[this.place(row)] as number
  }

  value(row: number): number {
    return this.values[this.place(row)] as number
  }

  /** Where a row is stored; no remainder, which takes longer than all the rest. */
  private place(row: number): number {
    const at = this.first + row
    return at < this.times.length ? at : at - this.times.length
  }

  /** First row at or after `time`, none before `from`; `length` when there is none. */
  firstAt(time: number, from = 0): number {
    let low = from
    let high = this.used
    if (from > 0) {
      // Who knows where it begins looks for something near: the reach doubles until it is inside.
      for (let reach = 8; low + reach < high; reach *= 2) {
        if (this.time(low + reach) >= time) high = low + reach
        else low += reach
      }
    }
    while (low < high) {
      const middle = (low + high) >> 1
      if (this.time(middle) < time) low = middle + 1
      else high = middle
    }
    return low
  }

  /** First row after `time`; `length` when there is none. */
  firstAfter(time: number): number {
    let row = this.firstAt(time)
    while (row < this.used && this.time(row) === time) row++
    return row
  }

  /** Least and greatest value of the rows from `begin` to before `end`; null without any. */
  extremes(begin: number, end: number): { low: number; high: number; lowFirst: boolean } | null {
    let low = Number.POSITIVE_INFINITY
    let high = Number.NEGATIVE_INFINITY
    let lowFirst = true
    let row = begin
    while (row < end) {
      const at = this.place(row)
      const whole = at % CHUNK === 0 && row + CHUNK <= end
      const least = (whole ? this.low[at / CHUNK] : this.values[at]) as number
      const greatest = (whole ? this.high[at / CHUNK] : this.values[at]) as number
      if (least < low) {
        low = least
        lowFirst = false
      }
      if (greatest > high) {
        high = greatest
        lowFirst = true
      }
      row += whole ? CHUNK : 1
    }
    return low <= high ? { low, high, lowFirst } : null
  }

  clear(): void {
    this.first = 0
    this.used = 0
    this.begun++
  }

  private grow(): void {
    // Only a full ring that never let a row go grows, so its rows lie in order from 0.
    const rows = Math.min(this.capacity, this.times.length * 2)
    const longer = (old: Float64Array, length: number) => {
      const next = new Float64Array(length)
      next.set(old)
      return next
    }
    this.times = longer(this.times, rows)
    this.values = longer(this.values, rows)
    this.low = longer(this.low, rows / CHUNK)
    this.high = longer(this.high, rows / CHUNK)
  }
}

/** A channel as it is shown: in the unit that the person chose. */
export class Trace {
  constructor(
    readonly ring: Ring,
    readonly factor = 1,
    readonly offset = 0,
  ) {}

  value(row: number): number {
    return this.ring.value(row) * this.factor + this.offset
  }

  extremes(begin: number, end: number): { low: number; high: number; lowFirst: boolean } | null {
    const found = this.ring.extremes(begin, end)
    if (!found) return null
    const [a, b] = [found.low * this.factor + this.offset, found.high * this.factor + this.offset]
    return this.factor >= 0
      ? { low: a, high: b, lowFirst: found.lowFirst }
      : { low: b, high: a, lowFirst: !found.lowFirst }
  }

  /** Last valid sample at or before a time, or null. */
  at(time: number): number | null {
    for (let row = this.ring.firstAfter(time) - 1; row >= 0; row--) {
      const value = this.value(row)
      if (Number.isFinite(value)) return value
    }
    return null
  }

  /** Between two samples, on the straight line through them; NaN outside. */
  between(time: number): number {
    const row = this.ring.firstAt(time)
    if (row >= this.ring.length) return Number.NaN
    const after = this.ring.time(row)
    if (after === time) return this.value(row)
    if (row === 0) return Number.NaN
    const before = this.ring.time(row - 1)
    const part = (time - before) / (after - before)
    return this.value(row - 1) * (1 - part) + this.value(row) * part
  }
}
