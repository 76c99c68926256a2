import { describe, expect, it } from 'vitest'
import type { AxisState, DriveSummary } from '../../../api/schema'
import { amount, checked, engineering, interval, preChecks, ready, stepOf } from './steps'

const drive = { lease: { holder: null, mine: false }, pending: 0 } as unknown as DriveSummary
const state = { fresh: true, faults: [], moving_job: null } as unknown as AxisState
const cyclic = { possible: true, running: false }

describe('pre-checks', () => {
  it('pass without a running exchange, which a measurement starts itself', () => {
    expect(ready(preChecks(drive, state, cyclic))).toBe(true)
  })
  it.each([
    ['no answer', drive, { ...state, fresh: false }, cyclic],
    ['no state yet', drive, null, cyclic],
    ['another holds control', { ...drive, lease: { holder: 'Li', mine: false } }, state, cyclic],
    ['a fault', drive, { ...state, faults: [{ kind: 'fault', name: 'over-current' }] }, cyclic],
    ['another motion', drive, { ...state, moving_job: 'j1' }, cyclic],
    ['parameters that wait', { ...drive, pending: 2 }, state, cyclic],
    ['a bus without process data', drive, state, { possible: false, running: false }],
  ])('fail with %s', (_why, d, s, c) => {
    expect(ready(preChecks(d as DriveSummary, s as AxisState | null, c))).toBe(false)
  })
  it('speak of no exchange on a bus that can have none', () => {
    const names = (possible: boolean) =>
      preChecks(drive, state, { possible, running: false }).map((each) => each.name)
    expect(names(false)).not.toContain('exchange')
    expect(names(true)).toContain('exchange')
  })
  it('let a warning pass', () => {
    const warned = { ...state, faults: [{ kind: 'warning', name: 'hot' }] } as unknown as AxisState
    expect(ready(preChecks(drive, warned, cyclic))).toBe(true)
  })
})

describe('the step of the pre-checks', () => {
  const moving = { ...state, moving_job: 'j1' } as AxisState
  it('stays done while a measurement runs, for which the consent was used up', () => {
    expect(checked(preChecks(drive, moving, cyclic), false)).toBe(true)
  })
  it('is not done without the consent, or while something else is missing', () => {
    expect(checked(preChecks(drive, state, cyclic), false)).toBe(false)
    expect(checked(preChecks(drive, state, cyclic), true)).toBe(true)
    const silent = { ...moving, fresh: false } as AxisState
    expect(checked(preChecks(drive, silent, cyclic), true)).toBe(false)
  })
})

describe('texts', () => {
  it('show the step of a job', () => {
    const third = { code: 'autotune.frequency-response', params: { step: 3, steps: 6 } }
    const within = { code: '+', params: { joint: ': ', part0: third, part1: { code: 'sweep.x' } } }
    expect(stepOf(third)).toEqual({ now: 3, of: 6 })
    expect(stepOf(within)).toEqual({ now: 3, of: 6 })
    expect(stepOf({ code: '', params: { words: '3 of 6: starting' } })).toBeNull()
  })
  it('write powers of ten as such', () => {
    expect(engineering(5.1234e-5)).toBe('5.12·10⁻⁵')
    expect(engineering(-2e-4)).toBe('−2.00·10⁻⁴')
    expect(engineering(0.0312)).toBe('0.0312')
    expect(engineering(0)).toBe('0')
  })
  it('give the interval next to the value, and nothing for what is not known', () => {
    expect(amount(0.03, 'N·m')).toBe('0.03 N·m')
    expect(amount(2, '')).toBe('2')
    expect(amount(null, 'N·m')).toBe('—')
    expect(interval([0.029, 0.031])).toBe('0.029 … 0.031')
    expect(interval([null, 2e-4])).toBe('— … 2.00·10⁻⁴')
    expect(interval(null)).toBe('')
  })
})
