import type { Trace } from './ring'

/**
 * Columns for uPlot: common times, then one array per trace; null where a trace has no sample.
 * Numbers without a gap come as they lie in memory, so that they pass to the page in one piece.
 */
export type Columns = [number[] | Float64Array, ...((number | null)[] | Float64Array)[]]

/**
 * Traces between two times, for a plot `bins` pixels wide.
 *
 * Few samples are given as they are. Many are reduced to the least and the greatest value of
 * each bin, so that no peak is ever lost to the drawing.
 */
export function columns(traces: Trace[], from: number, to: number, bins: number): Columns {
  const rings = new Set(traces.map((trace) => trace.ring))
  let samples = 0
  for (const ring of rings) {
    samples = Math.max(samples, ring.firstAfter(to) - ring.firstAt(from))
  }
  return samples <= 2 * bins ? exact(traces, from, to) : binned(traces, from, to, Math.max(1, bins))
}

function exact(traces: Trace[], from: number, to: number): Columns {
  const all: number[] = []
  for (const ring of new Set(traces.map((trace) => trace.ring))) {
    const end = ring.firstAfter(to)
    for (let row = ring.firstAt(from); row < end; row++) all.push(ring.time(row))
  }
  const times = [...new Set(Float64Array.from(all).sort())]
  const series = traces.map((trace) => {
    const { ring } = trace
    const values = new Array<number | null>(times.length).fill(null)
    let row = ring.firstAt(from)
    for (let i = 0; i < times.length && row < ring.length; i++) {
      if (ring.time(row) !== times[i]) continue
      // Two rows of the same time: the later one counts.
      while (row + 1 < ring.length && ring.time(row + 1) === times[i]) row++
      values[i] = finite(trace.value(row))
      row++
    }
    return values
  })
  return [times, ...series]
}

function binned(traces: Trace[], from: number, to: number, bins: number): Columns {
  const width = (to - from) / bins
  const times = new Float64Array(2 * bins)
  for (let bin = 0; bin < bins; bin++) {
    times[2 * bin] = from + (bin + 0.25) * width
    times[2 * bin + 1] = from + (bin + 0.75) * width
  }
  const series = traces.map((trace) => {
    const { ring } = trace
    const values = new Float64Array(2 * bins).fill(Number.NaN)
    let gaps = false
    let row = ring.firstAt(from)
    for (let bin = 0; bin < bins; bin++) {
      const end =
        bin === bins - 1 ? ring.firstAfter(to) : ring.firstAt(from + (bin + 1) * width, row)
      const found = trace.extremes(row, end)
      row = Math.max(row, end)
      if (!found) {
        gaps = true
        continue
      }
      values[2 * bin] = found.lowFirst ? found.low : found.high
      values[2 * bin + 1] = found.lowFirst ? found.high : found.low
    }
    return gaps ? Array.from(values, finite) : values
  })
  return [times, ...series]
}

/** Points of one curve, at most about `most`, with the extremes of each group kept. */
export function thinned(
  times: ArrayLike<number>,
  values: ArrayLike<number>,
  most: number,
): { times: number[]; values: number[] } {
  const group = Math.max(1, Math.ceil((2 * times.length) / most))
  const thin = { times: [] as number[], values: [] as number[] }
  for (let begin = 0; begin < times.length; begin += group) {
    let low = -1
    let high = -1
    for (let i = begin; i < Math.min(times.length, begin + group); i++) {
      const value = values[i] as number
      if (!Number.isFinite(value)) continue
      if (low < 0 || value < (values[low] as number)) low = i
      if (high < 0 || value > (values[high] as number)) high = i
    }
    for (const i of new Set([Math.min(low, high), Math.max(low, high)])) {
      if (i < 0) continue
      thin.times.push(times[i] as number)
      thin.values.push(values[i] as number)
    }
  }
  return thin
}

function finite(value: number): number | null {
  return Number.isFinite(value) ? value : null
}
