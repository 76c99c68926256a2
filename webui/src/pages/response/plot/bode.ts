import type { NotchShape, Sweep } from '../results'

/** One curve over frequency. Values that say nothing are null. */
export interface Curve {
  label: string
  color: string
  dashed?: boolean
  frequency: number[]
  magnitude: (number | null)[]
  phase: (number | null)[]
  coherence?: (number | null)[]
  /** Standard deviations of magnitude and phase; drawn as ± twice as much, a 95 % band. */
  stdMagnitude?: (number | null)[]
  stdPhase?: (number | null)[]
}

/** Below this coherence a line is noise, and is not drawn. */
export const LEAST_COHERENCE = 0.5
const BAND = 1.96

const unset = (value: number | null | undefined): value is null | undefined =>
  value === null || value === undefined || !Number.isFinite(value)

/** A measured response as a curve: lines drowned in noise are left out. */
export function measuredCurve(sweep: Sweep, label: string, color: string, dashed = false): Curve {
  const kept = sweep.coherence.map((value) => value >= LEAST_COHERENCE)
  const only = (values: (number | null)[]) => values.map((v, i) => (kept[i] ? v : null))
  return {
    label,
    color,
    dashed,
    frequency: sweep.frequency_hz,
    magnitude: only(sweep.magnitude_db),
    phase: only(wrapWhole(sweep.phase_deg, sweep.frequency_hz)),
    coherence: sweep.coherence,
    stdMagnitude: sweep.std_db,
    stdPhase: sweep.std_deg,
  }
}

/** The response of the load by a second encoder, within its band; null where there is none. */
export function loadCurve(sweep: Sweep, label: string, color: string): Curve | null {
  const load = sweep.load
  if (!load) return null
  const [low, high] = load.valid_band_hz
  const outside = load.frequency_hz.map((f) => f < low || f > high)
  const coherence = load.coherence.map((each, i) => (outside[i] ? 0 : each))
  return {
    ...measuredCurve({ ...sweep, ...load, coherence }, label, color),
    coherence: load.coherence,
  }
}

/** An unwrapped phase moved by whole turns so that its lowest lines lie within ±180°. */
export function wrapWhole(phase: number[], frequency: number[]): number[] {
  const first = phase.slice(0, Math.max(1, Math.ceil(frequency.length / 20)))
  const middle = first.toSorted((a, b) => a - b)[Math.floor(first.length / 2)] ?? 0
  const turns = Math.round(middle / 360)
  return turns === 0 ? phase : phase.map((each) => each - 360 * turns)
}

/** Curve of a measurement behind filters that are given at the same frequencies. */
export function filtered(
  curve: Curve,
  magnitude: number[],
  phase: number[],
  label: string,
  color: string,
): Curve {
  const plus = (values: (number | null)[], more: number[]) =>
    values.map((value, i) => (value === null ? null : value + (more[i] ?? 0)))
  return {
    label,
    color,
    frequency: curve.frequency,
    magnitude: plus(curve.magnitude, magnitude),
    phase: plus(curve.phase, phase),
  }
}

export type Part = 'magnitude' | 'phase' | 'coherence'
const STD = { magnitude: 'stdMagnitude', phase: 'stdPhase', coherence: null } as const

/** Values of a curve's part, and the edges of its 95 % band where it has one. */
export function partOf(
  curve: Curve,
  part: Part,
): { values: (number | null)[]; low: (number | null)[]; high: (number | null)[] } {
  const values = curve[part] ?? curve.frequency.map(() => null)
  const name = STD[part]
  const std = name === null ? undefined : curve[name]
  const edge = (sign: number) =>
    values.map((value, i) => {
      const spread = std?.[i]
      return unset(value) || unset(spread) ? null : value + sign * BAND * spread
    })
  return { values, low: std ? edge(-1) : [], high: std ? edge(1) : [] }
}

/** Frequencies of all curves, ascending, each once. */
export function gridOf(curves: Curve[]): number[] {
  return [...new Set(curves.flatMap((curve) => curve.frequency))]
    .filter((f) => f > 0)
    .toSorted((a, b) => a - b)
}

/** Values on a common grid; `undefined` where the curve has no line there, which breaks nothing. */
export function onGrid(
  grid: number[],
  frequency: number[],
  values: (number | null)[],
): (number | null | undefined)[] {
  if (grid === frequency) return values
  const at = new Map(frequency.map((f, i) => [f, values[i]]))
  return grid.map((f) => at.get(f))
}

/** Index of the line nearest to a frequency on a logarithmic axis; −1 where there is none. */
export function nearest(frequency: number[], wanted: number): number {
  let best = -1
  let distance = Number.POSITIVE_INFINITY
  for (const [i, f] of frequency.entries()) {
    const away = Math.abs(Math.log(f / wanted))
    if (away < distance) {
      best = i
      distance = away
    }
  }
  return best
}

/** Smallest and largest drawn value of curves within a band, with some air. */
export function rangeOf(
  curves: Curve[],
  part: 'magnitude' | 'phase',
  band: [number, number],
): [number, number] {
  let low = Number.POSITIVE_INFINITY
  let high = Number.NEGATIVE_INFINITY
  for (const curve of curves) {
    for (const [i, f] of curve.frequency.entries()) {
      const value = curve[part][i]
      if (unset(value) || f < band[0] || f > band[1]) continue
      low = Math.min(low, value)
      high = Math.max(high, value)
    }
  }
  if (low > high) return part === 'magnitude' ? [-40, 20] : [-180, 180]
  const step = part === 'magnitude' ? 10 : 45
  const air = part === 'magnitude' ? 2 : 10
  return [Math.floor((low - air) / step) * step, Math.ceil((high + air) / step) * step]
}

/** Frequencies worth a number on a logarithmic axis: 1, 2 and 5 of every decade. */
export function logTicks(from: number, to: number): number[] {
  const found: number[] = []
  for (let decade = Math.floor(Math.log10(from)); decade <= Math.log10(to); decade++) {
    for (const digit of [1, 2, 5]) {
      const f = digit * 10 ** decade
      if (f >= from * 0.999 && f <= to * 1.001) found.push(Number(f.toPrecision(3)))
    }
  }
  return found
}

/** Frequency as `12.5 Hz` or `1.25 kHz`. */
export function hertz(frequency: number | null | undefined): string {
  if (unset(frequency)) return '—'
  return frequency >= 1000
    ? `${Number((frequency / 1000).toPrecision(4))} kHz`
    : `${Number(frequency.toPrecision(4))} Hz`
}

/** A value with fixed decimals, a true minus sign, and its unit. */
export function fixed(value: number | null | undefined, decimals: number, unit = ''): string {
  if (unset(value)) return '—'
  const text = value.toFixed(decimals).replace(/^-(?=[\d.])/, '−')
  return unit === '' ? text : `${text}${unit === '°' ? '' : ' '}${unit}`
}

/** Rows for a table calculation: every line with its deviations, and those of the load beside. */
export function toCsv(sweep: Sweep): string {
  const columns = ['phase_deg', 'coherence', 'std_db', 'std_deg'] as const
  const names = (of: string) => [`${of}magnitude_db [${sweep.unit}]`, ...columns.map((c) => of + c)]
  const cells = (of: Pick<Sweep, 'magnitude_db' | (typeof columns)[number]>, i: number) => [
    of.magnitude_db[i] ?? '',
    ...columns.map((column) => of[column][i] ?? ''),
  ]
  const load = sweep.load
  const at = new Map(load?.frequency_hz.map((f, i) => [f, i]))
  const head = ['frequency_hz', ...names(''), ...(load ? names('load_') : [])]
  const rows = sweep.frequency_hz.map((f, i) => [
    f,
    ...cells(sweep, i),
    ...(load ? cells(load, at.get(f) ?? -1) : []),
  ])
  return [head, ...rows, []].map((row) => row.join(',')).join('\r\n')
}

/** A notch that takes a resonance away: as deep as it is high, and wider than it is. */
export function notchFor(frequency: number, damping: number, height: number): NotchShape {
  const width = Math.min(0.8, Math.max(0.3, 8 * damping)) * frequency
  return {
    center_hz: Number(frequency.toPrecision(4)),
    width_hz: Number(width.toPrecision(3)),
    depth_db: -Math.round(Math.min(30, Math.max(6, height))),
  }
}
