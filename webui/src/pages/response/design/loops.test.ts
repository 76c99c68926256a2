import { describe, expect, it } from 'vitest'
import { loopView, unwrapped } from './loops'
import type { Sweep } from '../results'

/** The closed loop of an integrator of crossover 50 Hz with 1 ms of delay. */
function sweepOf(frequency: number[]): { sweep: Sweep; open: { db: number; deg: number }[] } {
  const open = frequency.map((f) => ({
    db: 20 * Math.log10(50 / f),
    deg: -90 - 360 * f * 1e-3,
  }))
  const closed = open.map(({ db, deg }) => {
    const size = 10 ** (db / 20)
    const [re, im] = [
      size * Math.cos((deg * Math.PI) / 180),
      size * Math.sin((deg * Math.PI) / 180),
    ]
    const below = (1 + re) ** 2 + im ** 2
    const [a, b] = [(re * (1 + re) + im * im) / below, im / below]
    return {
      db: 20 * Math.log10(Math.hypot(a, b)),
      deg: (Math.atan2(b, a) * 180) / Math.PI,
    }
  })
  const sweep = {
    kind: 'speed_loop',
    frequency_hz: frequency,
    magnitude_db: closed.map((each) => each.db),
    phase_deg: unwrapped(closed.map((each) => each.deg)),
    std_db: frequency.map(() => 0.1),
    std_deg: frequency.map((_, i) => (i === 0 ? null : 1)),
  } as unknown as Sweep
  return { sweep, open }
}

const LINES = [5, 10, 20, 50, 100, 150, 200, 250]

describe('views of a closed loop', () => {
  const { sweep, open } = sweepOf(LINES)
  it('gives the open loop back that the closed one was made of', () => {
    const found = loopView(sweep, 'open')
    for (const [i, { db, deg }] of open.entries()) {
      expect(found.magnitude_db[i]).toBeCloseTo(db, 6)
      expect(found.phase_deg[i]).toBeCloseTo(deg, 6)
    }
  })
  it('gives the sensitivity 1/(1+L)', () => {
    const found = loopView(sweep, 'sensitivity')
    // At crossover |L| = 1 with a phase of −108°: |S| = 1 / (2 sin 36°).
    const at = LINES.indexOf(50)
    expect(found.magnitude_db[at]).toBeCloseTo(
      -20 * Math.log10(2 * Math.sin((36 * Math.PI) / 180)),
      6,
    )
  })
  it('widens the band where the open loop is more uncertain than the closed', () => {
    const found = loopView(sweep, 'open')
    // At 5 Hz the loop gain is 10: nearly all of T is 1, and 1−T is a tenth.
    expect(found.std_db[0]).toBeGreaterThan(0.9)
    expect(found.std_db[0]).toBeLessThan(1.1)
    expect(found.std_deg[0]).toBeNull()
  })
  it('leaves the closed loop and the mechanics as they are', () => {
    expect(loopView(sweep, 'closed')).toBe(sweep)
    const mechanics = { ...sweep, kind: 'mechanics' as const }
    expect(loopView(mechanics, 'open')).toBe(mechanics)
  })
})

it('goes on through whole turns of the phase', () => {
  expect(unwrapped([170, -170, -150, 175, 160])).toEqual([170, 190, 210, 175, 160])
})
