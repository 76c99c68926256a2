import { describe, expect, it } from 'vitest'
import { stepsDone } from './path'
import { present } from './sections'

const start = { ready: true, inertia: false, changed: null, measured: [], reported: null }
const axis = { automatic: true, running: null, tuned: false }
const saved = new Date(Date.UTC(2026, 2, 1)).toISOString()

describe('what is open when Tune is opened', () => {
  it('is what is missing before anything moves', () => {
    expect(present(stepsDone({ ...start, ready: false }), axis)).toEqual(['checks'])
  })
  it('is the automatic tuning on an axis that nobody has tuned', () => {
    expect(present(stepsDone(start), axis)).toEqual(['automatic'])
  })
  it('is the first step by hand where the axis cannot be tuned automatically', () => {
    const manual = { ...axis, automatic: false }
    expect(present(stepsDone(start), manual)).toEqual(['manual', 'inertia'])
  })
  it('is the next step by hand where one was done by hand', () => {
    expect(present(stepsDone({ ...start, inertia: true }), axis)).toEqual(['manual', 'response'])
  })
  it('is the report after the verification, and nothing after the report', () => {
    const measured = ['sweep-speed_loop', 'sweep-mechanics'].map((kind) => ({ kind, saved }))
    const tuned = { ...start, inertia: true, changed: saved, measured }
    expect(present(stepsDone(tuned), axis)).toEqual(['report'])
    expect(present(stepsDone({ ...tuned, reported: saved }), axis)).toEqual([])
  })
  it('is the verdict of the automatic tuning too, until the report was made', () => {
    const measured = ['sweep-speed_loop', 'sweep-mechanics'].map((kind) => ({ kind, saved }))
    const tuned = { ...start, inertia: true, changed: saved, measured }
    const judged = { ...axis, tuned: true }
    expect(present(stepsDone(tuned), judged)).toEqual(['automatic', 'report'])
    expect(present(stepsDone({ ...tuned, reported: saved }), judged)).toEqual([])
  })
  it('is the step whose job runs, although a moving axis fails the pre-checks', () => {
    const moving = stepsDone({ ...start, ready: false })
    expect(present(moving, { ...axis, running: 'inertia' })).toEqual(['manual', 'inertia'])
    expect(present(moving, { ...axis, running: 'automatic' })).toEqual(['automatic'])
  })
})
