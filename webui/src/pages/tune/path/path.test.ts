import { describe, expect, it } from 'vitest'
import { type Known, later, nextStep, STEPS, stepsDone, tunedAt } from './path'

const at = (minute: number) => new Date(Date.UTC(2026, 2, 1, 12, minute)).toISOString()
const start: Known = { ready: false, inertia: false, changed: null, measured: [], reported: null }

describe('the guided path', () => {
  it('has the order of the automatic tuning', () => {
    expect(STEPS.join(' ')).toBe('checks inertia response notches gains verify report')
  })
  it('begins with what must be right before anything moves', () => {
    expect(nextStep(stepsDone(start))).toBe('checks')
    expect(nextStep(stepsDone({ ...start, ready: true }))).toBe('inertia')
  })
  it('asks for a verification after every change', () => {
    const measured = [
      { kind: 'sweep-speed_loop', saved: at(5) },
      { kind: 'sweep-mechanics', saved: at(3) },
      { kind: 'inertia', saved: at(2) },
    ]
    const known = { ...start, ready: true, changed: at(4), measured }
    expect(stepsDone(known).verify).toBe(true)
    expect(nextStep(stepsDone(known))).toBe('report')
    expect(nextStep(stepsDone({ ...known, changed: at(6) }))).toBe('verify')
    // The loop as it was before any change is not its verification.
    expect(stepsDone({ ...known, changed: null }).verify).toBe(false)
  })
  it('asks for a new report after a new verification', () => {
    const measured = [{ kind: 'sweep-speed_loop', saved: at(5) }]
    const known = { ...start, changed: at(4), measured }
    expect(stepsDone({ ...known, reported: at(3) }).report).toBe(false)
    expect(stepsDone({ ...known, reported: at(6) }).report).toBe(true)
  })
  it('takes a tuning that verified what it wrote as verified, until something else changes', () => {
    const job = { started: at(1), ended: at(6) }
    const measured = [
      { kind: 'sweep-speed_loop', saved: at(5) },
      { kind: 'sweep-mechanics', saved: at(3) },
    ]
    const done = (verified: boolean, changed: string | null) =>
      stepsDone({
        ...start,
        measured,
        changed: later(changed, tunedAt({ applied: true, verified }, job)),
      }).verify
    expect(done(true, null)).toBe(true)
    expect(done(true, at(7))).toBe(false)
    expect(done(false, null)).toBe(false)
    expect(tunedAt({ applied: null, verified: null }, job)).toBeNull()
  })
  it('ends', () => {
    const all = stepsDone({
      ready: true,
      inertia: true,
      changed: at(4),
      measured: [
        { kind: 'sweep-position_loop', saved: at(5) },
        { kind: 'sweep-mechanics', saved: at(3) },
      ],
      reported: at(6),
    })
    expect(nextStep(all)).toBeNull()
  })
})
