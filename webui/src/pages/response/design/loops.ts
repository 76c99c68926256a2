import type { Curve } from '../plot/bode'
import type { Sweep } from '../results'

/** What is shown of a closed loop T: itself, L = T/(1−T), or S = 1−T. */
export const LOOP_VIEWS = ['closed', 'open', 'sensitivity'] as const
export type LoopView = (typeof LOOP_VIEWS)[number]

interface Complex {
  re: number
  im: number
}

const RADIAN = Math.PI / 180
const DB = 20 / Math.LN10
/** Below this |1−T| nothing is left of the open loop but noise. */
const LEAST = 1e-6

const fromPolar = (db: number, deg: number): Complex => {
  const size = 10 ** (db / 20)
  return { re: size * Math.cos(deg * RADIAN), im: size * Math.sin(deg * RADIAN) }
}
const sizeOf = (z: Complex) => Math.hypot(z.re, z.im)
const over = (a: Complex, b: Complex): Complex => {
  const square = b.re * b.re + b.im * b.im
  return { re: (a.re * b.re + a.im * b.im) / square, im: (a.im * b.re - a.re * b.im) / square }
}

/** Phases that jump by nearly a whole turn are the same line going on. */
export function unwrapped(deg: number[]): number[] {
  let turns = 0
  let last = deg[0] ?? 0
  return deg.map((each) => {
    if (each - last > 180) turns -= 1
    if (each - last < -180) turns += 1
    last = each
    return each + 360 * turns
  })
}

/**
 * A measured closed loop as another view of it, with the same fields, so that it is drawn alike.
 * Deviations follow to first order: dL/L = dT/T · 1/(1−T), and dS/S = dT/T · T/(1−T).
 */
export function loopView(sweep: Sweep, view: LoopView): Sweep {
  if (view === 'closed' || sweep.kind === 'mechanics') return sweep
  const made = sweep.frequency_hz.map((_, i) => {
    const t = fromPolar(sweep.magnitude_db[i] ?? 0, sweep.phase_deg[i] ?? 0)
    const s = { re: 1 - t.re, im: -t.im }
    const left = Math.max(sizeOf(s), LEAST)
    const z = view === 'open' ? over(t, left === LEAST ? { re: LEAST, im: 0 } : s) : s
    return { z, grows: view === 'open' ? 1 / left : sizeOf(t) / left }
  })
  const scaled = (std: (number | null)[]) =>
    std.map((each, i) => (each === null ? null : each * (made[i]?.grows ?? 1)))
  return {
    ...sweep,
    magnitude_db: made.map(({ z }) => DB * Math.log(Math.max(sizeOf(z), LEAST))),
    phase_deg: unwrapped(made.map(({ z }) => Math.atan2(z.im, z.re) / RADIAN)),
    std_db: scaled(sweep.std_db),
    std_deg: scaled(sweep.std_deg),
  }
}

/** A horizontal line that a loop must not cross, or crosses at its bandwidth. */
export function guide(view: LoopView, curve: Curve, label: string, color: string): Curve {
  const level = view === 'closed' ? -3 : view === 'open' ? 0 : 6
  return {
    label,
    color,
    dashed: true,
    frequency: curve.frequency,
    magnitude: curve.frequency.map(() => level),
    phase: curve.frequency.map(() => null),
  }
}
