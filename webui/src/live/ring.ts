import type { ScopeBlock } from './blocks'

/** The last rows of one subscription. Bounded: the oldest row makes room for the newest. */
export class Ring {
  readonly channels: number
  readonly capacity: number
  private readonly times: Float64Array
  private readonly values: Float32Array
  private start = 0
  private used = 0
  /** Samples that the server had to leave out, and blocks that never arrived. */
  dropped = 0
  lostBlocks = 0
  private sequence: number | null = null

  constructor(channels: number, capacity: number) {
    this.channels = channels
    this.capacity = capacity
    this.times = new Float64Array(capacity)
    this.values = new Float32Array(capacity * channels)
  }

  get length(): number {
    return this.used
  }

  push(block: ScopeBlock): void {
    if (block.channels !== this.channels) return
    if (this.sequence !== null && block.sequence > this.sequence + 1) {
      this.lostBlocks += block.sequence - this.sequence - 1
    }
    this.sequence = block.sequence
    this.dropped += block.dropped
    for (let row = 0; row < block.rows; row++) {
      const at = (this.start + this.used) % this.capacity
      this.times[at] = block.times[row] as number
      for (let k = 0; k < this.channels; k++) {
        this.values[at * this.channels + k] = block.samples[row * this.channels + k] as number
      }
      if (this.used < this.capacity) this.used++
      else this.start = (this.start + 1) % this.capacity
    }
  }

  time(row: number): number {
    return this.times[(this.start + row) % this.capacity] as number
  }

  value(row: number, channel: number): number {
    return this.values[((this.start + row) % this.capacity) * this.channels + channel] as number
  }

  get newest(): number | null {
    return this.used === 0 ? null : this.time(this.used - 1)
  }

  /** First row at or after `time`; `length` when there is none. */
  firstAt(time: number): number {
    let low = 0
    let high = this.used
    while (low < high) {
      const middle = (low + high) >> 1
      if (this.time(middle) < time) low = middle + 1
      else high = middle
    }
    return low
  }

  clear(): void {
    this.start = 0
    this.used = 0
    this.dropped = 0
    this.lostBlocks = 0
    this.sequence = null
  }
}
