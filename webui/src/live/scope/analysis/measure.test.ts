import { describe, expect, it } from 'vitest'
import { measure } from './measure'
import { Ring, Trace } from '../ring'

function traceOf(times: number[], values: number[]): Trace {
  const ring = new Ring(10_000)
  for (const [i, time] of times.entries()) ring.push(time, values[i] as number)
  return new Trace(ring)
}

const grid = (n: number, rate: number) => Array.from({ length: n }, (_, i) => i / rate)

/** Normal noise that is the same in every run. */
function noise(n: number): number[] {
  let seed = 12345
  const next = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648
  return Array.from({ length: n }, () => {
    const radius = Math.sqrt(-2 * Math.log(next() + 1e-12))
    return radius * Math.cos(2 * Math.PI * next())
  })
}

describe('measurements', () => {
  it('agree with a sine: mean 0, RMS A/√2, peak-peak 2A, its frequency', () => {
    const times = grid(2000, 1000)
    const values = times.map((time) => 3 * Math.sin(2 * Math.PI * 5 * time))
    const found = measure(traceOf(times, values), 0, 2)
    expect(found?.count).toBe(2000)
    expect(found?.mean).toBeCloseTo(0, 5)
    expect(found?.rms).toBeCloseTo(3 / Math.SQRT2, 5)
    expect(found?.peakToPeak).toBeCloseTo(6, 3)
    expect(found?.frequency).toBeCloseTo(5, 4)
  })
  it('find the rise time of a first-order step, T·ln 9', () => {
    const T = 0.05
    const times = grid(2000, 1000)
    const values = times.map((time) => (time < 0.5 ? 2 : 2 + 8 * (1 - Math.exp((0.5 - time) / T))))
    const found = measure(traceOf(times, values), 0, 2)
    expect(found?.riseTime).toBeCloseTo(T * Math.log(9), 3)
    expect(found?.overshoot).toBeLessThan(1)
    // From 10 %, T·ln(1/0.9), to within 2 %, T·ln(1/0.02).
    expect(found?.settling).toBeCloseTo(T * Math.log(0.9 / 0.02), 3)
  })
  it('find the overshoot of a second-order step, exp(−πζ/√(1−ζ²))', () => {
    const [zeta, w] = [0.3, 60]
    const wd = w * Math.sqrt(1 - zeta ** 2)
    const times = grid(3000, 1000)
    const values = times.map((time) => {
      const t = time - 0.5
      if (t < 0) return 0
      const wave = Math.cos(wd * t) + ((zeta * w) / wd) * Math.sin(wd * t)
      return -100 * (1 - Math.exp(-zeta * w * t) * wave)
    })
    const found = measure(traceOf(times, values), 0, 3)
    const expected = 100 * Math.exp((-Math.PI * zeta) / Math.sqrt(1 - zeta ** 2))
    expect(Math.abs((found?.overshoot ?? 0) - expected)).toBeLessThan(0.5)
  })
  it('find none where there is none', () => {
    const flat = measure(traceOf([0, 1, 2, 3], [4, 4, 4, 4]), 0, 3)
    expect(flat).toMatchObject({ riseTime: null, frequency: null, settling: null, mean: 4 })
    expect(measure(traceOf([0], [1]), 5, 6)).toBeNull()
  })
  it('leave invalid samples out', () => {
    const trace = traceOf([0, 1, 2], [1, Number.NaN, 3])
    expect(measure(trace, 0, 2)).toMatchObject({ count: 2, mean: 2 })
    expect(trace.at(1.5)).toBe(1)
    expect(trace.at(-1)).toBeNull()
  })
})

describe('noise is no step', () => {
  const times = grid(2000, 1000)
  const stepless = { riseTime: null, overshoot: null, settling: null }
  it('neither white', () => {
    expect(measure(traceOf(times, noise(2000)), 0, 2)).toMatchObject(stepless)
    expect(measure(traceOf(grid(60, 30), noise(60)), 0, 2)).toMatchObject(stepless)
  })
  it('nor filtered, as the torque of an axis that holds its position', () => {
    let low = 0
    const slow = noise(2000).map((value) => (low += (value - low) / 20))
    expect(measure(traceOf(times, slow), 0, 2)).toMatchObject(stepless)
  })
  it('nor the flicker of the last digit of a speed at standstill', () => {
    const flicker = noise(2000).map((value) => (value > 0 ? 1 : 0))
    expect(measure(traceOf(times, flicker), 0, 2)).toMatchObject(stepless)
  })
  it('but a step with noise on it is one', () => {
    const T = 0.05
    const noisy = noise(2000).map((value, i) => {
      const time = (times[i] as number) - 0.5
      return (time < 0 ? 0 : 10 * (1 - Math.exp(-time / T))) + 0.1 * value
    })
    const found = measure(traceOf(times, noisy), 0, 2)
    expect(found?.riseTime).toBeGreaterThan(0.8 * T * Math.log(9))
    expect(found?.riseTime).toBeLessThan(1.2 * T * Math.log(9))
  })
})
