import type { Trace } from './decimate'

/** Figures of one trace over a stretch of time, from every raw sample in it. */
export interface Measurement {
  count: number
  min: number
  max: number
  mean: number
  rms: number
  peakToPeak: number
}

/** Null where the stretch holds no valid sample. */
export function measure({ ring, channel }: Trace, from: number, to: number): Measurement | null {
  let count = 0
  let min = Number.POSITIVE_INFINITY
  let max = Number.NEGATIVE_INFINITY
  let sum = 0
  let squares = 0
  for (let row = ring.firstAt(from); row < ring.length && ring.time(row) <= to; row++) {
    const value = ring.value(row, channel)
    if (!Number.isFinite(value)) continue
    count++
    if (value < min) min = value
    if (value > max) max = value
    sum += value
    squares += value * value
  }
  if (count === 0) return null
  return {
    count,
    min,
    max,
    mean: sum / count,
    rms: Math.sqrt(squares / count),
    peakToPeak: max - min,
  }
}

/** Value at a time: the last valid sample at or before it, or null. */
export function valueAt({ ring, channel }: Trace, time: number): number | null {
  let row = ring.firstAt(time)
  if (row >= ring.length || ring.time(row) > time) row--
  for (; row >= 0; row--) {
    const value = ring.value(row, channel)
    if (Number.isFinite(value)) return value
  }
  return null
}
