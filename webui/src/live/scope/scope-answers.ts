/** Answers of the scope that follow from its traces alone. */
import { csvText } from './csv-text'
import { columns, thinned } from './decimate'
import type { stretch } from './analysis/measure'
import type { Trace } from './ring'
import type { Sweep } from './trigger'
import type { Overlay, Questions } from '../worker/worker-messages'

/** These sweeps, oldest first, in times from their trigger. */
export function overlays(sweeps: Sweep[], traces: Trace[], bins: number): Overlay[] {
  return sweeps.flatMap((sweep) => {
    const [times, ...series] = columns(traces, sweep.from, sweep.to, bins)
    return series.map((values, trace) => {
      const shown = Array.from(times, (_, i) => i).filter((i) => values[i] != null)
      return {
        trace,
        times: shown.map((i) => (times[i] as number) - sweep.at),
        values: shown.map((i) => values[i] as number),
      }
    })
  })
}

/** Raw samples as CSV: one row per time, empty where a trace has no sample then. */
export function csv(
  traces: Trace[],
  names: string[],
  { from, to, origin }: { from: number; to: number; origin: number },
): string {
  const [times, ...series] = columns(traces, from, to, Number.MAX_SAFE_INTEGER)
  const quoted = ['time_s', ...names].map(csvText)
  const lines = [quoted.join(',')]
  for (let i = 0; i < times.length; i++) {
    const values = series.map((column) => column[i] ?? '')
    lines.push([((times[i] as number) - origin).toFixed(6), ...values].join(','))
  }
  return `${lines.join('\r\n')}\r\n`
}

/** One channel over another, at the times of the first; the extremes of both are kept. */
export function xy(
  over: Trace,
  of: ReturnType<typeof stretch>,
  most: number,
): Questions['xy']['get'] {
  const across = Float64Array.from(of.times, (time) => over.between(time))
  const kept = new Set([
    ...thinned(of.times, of.values, most / 2).times,
    ...thinned(of.times, across, most / 2).times,
  ])
  const points: Questions['xy']['get'] = { x: [], y: [], times: [] }
  for (let i = 0; i < of.times.length; i++) {
    const [px, py] = [across[i] as number, of.values[i] as number]
    if (!kept.has(of.times[i] as number) || !Number.isFinite(px)) continue
    points.x.push(px)
    points.y.push(py)
    points.times.push(of.times[i] as number)
  }
  return points
}
