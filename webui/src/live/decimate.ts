import type { Ring } from './ring'

/** One trace: a channel of a ring. */
export interface Trace {
  ring: Ring
  channel: number
}

/** Columns for uPlot: common times, then one array per trace; null where a trace has no sample. */
export type Columns = [number[], ...(number | null)[][]]

/**
 * Traces between two times, for a plot `bins` pixels wide.
 *
 * Few samples are given as they are. Many are reduced to the least and the greatest value of
 * each bin, so that no peak is ever lost to the drawing.
 */
export function columns(traces: Trace[], from: number, to: number, bins: number): Columns {
  const rings = new Set(traces.map((trace) => trace.ring))
  let samples = 0
  for (const ring of rings) samples += Math.max(0, ring.firstAt(to) - ring.firstAt(from))
  return samples <= 2 * bins
    ? exact(traces, [...rings], from, to)
    : binned(traces, from, to, Math.max(1, bins))
}

function exact(traces: Trace[], rings: Ring[], from: number, to: number): Columns {
  const times: number[] = []
  for (const ring of rings) {
    const end = lastInside(ring, to)
    for (let row = ring.firstAt(from); row < end; row++) times.push(ring.time(row))
  }
  times.sort((a, b) => a - b)
  const unique = times.filter((time, i) => i === 0 || time !== times[i - 1])
  const series = traces.map(({ ring, channel }) => {
    const values = new Array<number | null>(unique.length).fill(null)
    let row = ring.firstAt(from)
    for (let i = 0; i < unique.length && row < ring.length; i++) {
      if (ring.time(row) !== unique[i]) continue
      values[i] = finite(ring.value(row, channel))
      row++
    }
    return values
  })
  return [unique, ...series]
}

function binned(traces: Trace[], from: number, to: number, bins: number): Columns {
  const width = (to - from) / bins
  const times = new Array<number>(2 * bins)
  for (let bin = 0; bin < bins; bin++) {
    times[2 * bin] = from + (bin + 0.25) * width
    times[2 * bin + 1] = from + (bin + 0.75) * width
  }
  const series = traces.map(({ ring, channel }) => {
    const values = new Array<number | null>(2 * bins).fill(null)
    const end = lastInside(ring, to)
    let row = ring.firstAt(from)
    while (row < end) {
      const bin = Math.min(bins - 1, Math.floor((ring.time(row) - from) / width))
      const edge = from + (bin + 1) * width
      let low = Number.POSITIVE_INFINITY
      let high = Number.NEGATIVE_INFINITY
      let lowFirst = true
      do {
        const value = ring.value(row, channel)
        if (value < low) {
          low = value
          lowFirst = false
        }
        if (value > high) {
          high = value
          lowFirst = true
        }
        row++
      } while (row < end && (bin === bins - 1 || ring.time(row) < edge))
      if (low <= high) {
        values[2 * bin] = lowFirst ? low : high
        values[2 * bin + 1] = lowFirst ? high : low
      }
    }
    return values
  })
  return [times, ...series]
}

function lastInside(ring: Ring, to: number): number {
  let end = ring.firstAt(to)
  while (end < ring.length && ring.time(end) === to) end++
  return end
}

function finite(value: number): number | null {
  return Number.isFinite(value) ? value : null
}
