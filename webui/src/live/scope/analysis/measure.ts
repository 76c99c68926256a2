import type { Trace } from '../ring'

/** Figures of one trace over a stretch of time, from every raw sample in it. */
export interface Measurement {
  count: number
  min: number
  max: number
  mean: number
  rms: number
  peakToPeak: number
  /** Of the first whole transition, 10 % to 90 %, seconds; null without one, and for noise. */
  riseTime: number | null
  /** How far it goes beyond its new level, per cent of the step; null without a transition. */
  overshoot: number | null
  /** From 10 % of the transition until it stays within 2 % of the step about where it ends. */
  settling: number | null
  /** Of a signal that crosses its middle again and again, Hz; null where it does not. */
  frequency: number | null
}

const LEVEL_BINS = 128
/** Part of the peak-peak that a signal must pass beyond its middle for a crossing to count. */
const HYSTERESIS = 0.1
const SETTLED = 0.02

/** Null where the stretch holds no valid sample. */
export function measure(trace: Trace, from: number, to: number): Measurement | null {
  const { times, values } = stretch(trace, from, to)
  const count = values.length
  if (count === 0) return null
  let min = Number.POSITIVE_INFINITY
  let max = Number.NEGATIVE_INFINITY
  let sum = 0
  let squares = 0
  for (const value of values) {
    if (value < min) min = value
    if (value > max) max = value
    sum += value
    squares += value * value
  }
  const mean = sum / count
  return {
    count,
    min,
    max,
    mean,
    rms: Math.sqrt(squares / count),
    peakToPeak: max - min,
    ...step(times, values, min, max),
    frequency: frequency(times, values, min, max),
  }
}

/** The valid samples of a stretch. */
export function stretch(
  trace: Trace,
  from: number,
  to: number,
): { times: Float64Array; values: Float64Array } {
  const { ring } = trace
  const begin = ring.firstAt(from)
  const end = ring.firstAfter(to)
  const times = new Float64Array(Math.max(0, end - begin))
  const values = new Float64Array(times.length)
  let n = 0
  for (let row = begin; row < end; row++) {
    const value = trace.value(row)
    if (!Number.isFinite(value)) continue
    times[n] = ring.time(row)
    values[n++] = value
  }
  return { times: times.subarray(0, n), values: values.subarray(0, n) }
}

/** Time at which the line from sample i−1 to i passes a level. */
function crossing(times: Float64Array, values: Float64Array, i: number, level: number): number {
  const [t0, t1] = [times[i - 1] as number, times[i] as number]
  const [v0, v1] = [values[i - 1] as number, values[i] as number]
  return v1 === v0 ? t1 : t0 + ((level - v0) / (v1 - v0)) * (t1 - t0)
}

/**
 * Low and high level: the commonest values of the lower and the upper half of the range, the
 * histogram method of IEEE Std 181-2011, clause 5.2.
 */
function levels(values: Float64Array, min: number, max: number): [number, number] {
  const counts = new Float64Array(LEVEL_BINS)
  const sums = new Float64Array(LEVEL_BINS)
  for (const value of values) {
    const bin = Math.min(LEVEL_BINS - 1, Math.floor(((value - min) / (max - min)) * LEVEL_BINS))
    counts[bin] = (counts[bin] as number) + 1
    sums[bin] = (sums[bin] as number) + value
  }
  const level = (begin: number, end: number) => {
    let best = begin
    for (let bin = begin; bin < end; bin++) {
      if ((counts[bin] as number) > (counts[best] as number)) best = bin
    }
    return (sums[best] as number) / (counts[best] as number)
  }
  return [level(0, LEVEL_BINS / 2), level(LEVEL_BINS / 2, LEVEL_BINS)]
}

/** A sample is at a level within this part of the step. */
const AT_LEVEL = 0.2
/** Mean square of the change from sample to sample, as part of the variance: 2 for white noise. */
const RESTLESS = 0.5

/**
 * Whether the signal stays at its two levels, at least half of the time, and goes from sample to
 * sample by little: noise, also the flicker of a last digit, has levels and edges without end but
 * no step. The second is von Neumann's ratio (Ann. Math. Statist. 12, 1941, p. 367).
 */
function dwells(values: Float64Array, low: number, size: number): boolean {
  let sum = 0
  let squares = 0
  let changes = 0
  let at = 0
  for (let i = 0; i < values.length; i++) {
    const part = ((values[i] as number) - low) / size
    if (Math.min(Math.abs(part), Math.abs(part - 1)) <= AT_LEVEL) at++
    sum += part
    squares += part * part
    if (i > 0) changes += (part - ((values[i - 1] as number) - low) / size) ** 2
  }
  const variance = squares - (sum * sum) / values.length
  return at >= values.length / 2 && changes <= RESTLESS * variance
}

const NO_STEP = { riseTime: null, overshoot: null, settling: null }

function step(
  times: Float64Array,
  values: Float64Array,
  min: number,
  max: number,
): Pick<Measurement, 'riseTime' | 'overshoot' | 'settling'> {
  if (!(max > min) || values.length < 4) return NO_STEP
  const [low, high] = levels(values, min, max)
  const size = high - low
  if (!(size > 0) || !dwells(values, low, size)) return NO_STEP
  const found = transition(times, values, low, size)
  if (!found) return NO_STEP
  const { begin, end, rising } = found
  const beyond = rising ? max - high : low - min
  return {
    riseTime: end - begin,
    overshoot: (100 * Math.max(0, beyond)) / size,
    settling: settling(times, values, begin, size),
  }
}

/** The first time that a signal goes from below 10 % to above 90 %, or the other way. */
function transition(
  times: Float64Array,
  values: Float64Array,
  low: number,
  size: number,
): { begin: number; end: number; rising: boolean } | null {
  const part = (i: number) => ((values[i] as number) - low) / size
  let left: { time: number; rising: boolean } | null = null
  for (let i = 1; i < values.length; i++) {
    const [before, now] = [part(i - 1), part(i)]
    if (before < 0.1 && now >= 0.1) {
      left = { time: crossing(times, values, i, low + 0.1 * size), rising: true }
    } else if (before > 0.9 && now <= 0.9) {
      left = { time: crossing(times, values, i, low + 0.9 * size), rising: false }
    }
    if (left?.rising && before < 0.9 && now >= 0.9) {
      return { begin: left.time, end: crossing(times, values, i, low + 0.9 * size), rising: true }
    }
    if (left && !left.rising && before > 0.1 && now <= 0.1) {
      return { begin: left.time, end: crossing(times, values, i, low + 0.1 * size), rising: false }
    }
  }
  return null
}

/** Null where it does not settle within the stretch. */
function settling(
  times: Float64Array,
  values: Float64Array,
  begin: number,
  size: number,
): number | null {
  const tail = Math.max(1, Math.floor(values.length / 10))
  let end = 0
  for (let i = values.length - tail; i < values.length; i++) end += values[i] as number
  end /= tail
  let last = values.length - 1
  while (last >= 0 && Math.abs((values[last] as number) - end) <= SETTLED * size) last--
  // Still on its way where the tail itself begins.
  if (last >= values.length - tail) return null
  if (last < 0 || (times[last] as number) < begin) return 0
  const edge = end + Math.sign((values[last] as number) - end) * SETTLED * size
  return crossing(times, values, last + 1, edge) - begin
}

function frequency(
  times: Float64Array,
  values: Float64Array,
  min: number,
  max: number,
): number | null {
  const middle = (min + max) / 2
  const air = (max - min) * HYSTERESIS
  if (!(air > 0)) return null
  let below = false
  let first: number | null = null
  let last = 0
  let rises = 0
  let crossed: number | null = null
  for (let i = 1; i < values.length; i++) {
    const value = values[i] as number
    if ((values[i - 1] as number) < middle && value >= middle) {
      crossed = crossing(times, values, i, middle)
    }
    if (value < middle - air) below = true
    if (below && value > middle + air && crossed !== null) {
      first ??= crossed
      last = crossed
      rises++
      below = false
    }
  }
  return rises >= 2 && first !== null && last > first ? (rises - 1) / (last - first) : null
}
