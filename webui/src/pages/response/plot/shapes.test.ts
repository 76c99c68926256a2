import { describe, expect, it } from 'vitest'
import type { Resonance, Sweep } from '../results'
import { judge } from './shapes'

const peak = (frequency_hz: number, damping = 0.02): Resonance => ({
  kind: 'resonance',
  frequency_hz,
  damping,
  height_db: 20,
})
const valley = (frequency_hz: number): Resonance => ({
  kind: 'antiresonance',
  frequency_hz,
  damping: 0.02,
  height_db: -20,
})
const sweep = (resonances: Resonance[], more: Partial<Sweep> = {}) =>
  ({
    kind: 'mechanics',
    trusted: true,
    resonances,
    valid_band_hz: [5, 400],
    frequency_hz: [10, 100, 300],
    coherence: [1, 1, 1],
    saturated_share: 0,
    ...more,
  }) as unknown as Sweep

describe('the shape of a response', () => {
  it('shows how much inertia hangs behind the soft part', () => {
    // Two masses and a spring: f_r² / f_a² = 1 + J_load / J_motor.
    expect(judge(sweep([valley(100), peak(200)]), null).ratio).toBeCloseTo(3, 9)
  })
  it.each([
    ['compliant', [valley(60), peak(90)]],
    ['medium', [valley(100), peak(200)]],
    ['stiff', [valley(320), peak(500)]],
    ['stiff', []],
  ] as const)('calls a load %s', (load, found) => {
    expect(judge(sweep([...found]), null).load).toBe(load)
  })
  it('judges no load where no model fits', () => {
    const found = judge(sweep([], { trusted: false }), null)
    expect(found.load).toBeNull()
    expect(found.hints).toEqual(['untrusted'])
  })
  it.each([
    ['noise', sweep([], { coherence: [0.5, 0.6, 1] }), null],
    ['saturated', sweep([], { saturated_share: 0.1 }), null],
    ['moved', sweep([valley(100), peak(200)]), sweep([valley(100), peak(220)])],
    ['wide', sweep([peak(200, 0.12)]), null],
    ['low', sweep([valley(50), peak(80)]), null],
    ['many', sweep([peak(100), peak(200), peak(300)]), null],
  ] as const)('hints at %s', (hint, now, before) => {
    expect(judge(now, before).hints).toEqual([hint])
  })
  it('says nothing of a peak that stayed where it was', () => {
    const now = sweep([valley(100), peak(200)])
    expect(judge(now, sweep([valley(100), peak(203)])).hints).toEqual([])
    expect(judge(now, sweep([], { kind: 'speed_loop' })).hints).toEqual([])
  })
})
