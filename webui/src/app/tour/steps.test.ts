import { describe, expect, it } from 'vitest'
import type { AxisState, JobInfo } from '../../api/schema'
import { isDone, STEPS } from './steps'

const job = (kind: string, state: string, drive = 'x', id = 'new') =>
  ({ id, kind, state, drive }) as JobInfo
const state = (name: string, faults: unknown[] = []) =>
  ({ fresh: true, state: name, faults }) as unknown as AxisState
const before = { jobs: new Set(['old']), undone: 1, faulty: false }
const now = (jobs: JobInfo[] = [], more = {}) => ({ jobs, undone: 1, state: null, ...more })

describe('a step of the tour', () => {
  it('is done by a job of its kind on its axis that began since', () => {
    expect(isDone('jog', 'x', before, now([job('jog', 'done')]))).toBe(true)
    expect(isDone('jog', 'x', before, now([job('jog', 'done', 'x', 'old')]))).toBe(false)
    expect(isDone('jog', 'x', before, now([job('jog', 'done', 'y')]))).toBe(false)
    expect(isDone('jog', 'x', before, now([job('jog', 'running')]))).toBe(false)
    expect(isDone('response', 'x', before, now([job('jog', 'done')]))).toBe(false)
  })
  it('is not done by a measurement that failed', () => {
    expect(isDone('response', 'x', before, now([job('sweep', 'failed')]))).toBe(false)
    expect(isDone('tune', 'x', before, now([job('autotune', 'cancelled')]))).toBe(false)
    expect(isDone('tune', 'x', before, now([job('autotune', 'done')]))).toBe(true)
  })
  it('of a fault is done once a fault has come and gone', () => {
    const good = state('Switch on disabled')
    expect(isDone('fault', 'x', before, now([], { state: good }))).toBe(false)
    const seen = { ...before, faulty: true }
    expect(isDone('fault', 'x', seen, now([], { state: state('Fault') }))).toBe(false)
    expect(isDone('fault', 'x', seen, now([], { state: state('Ready', [{}]) }))).toBe(false)
    expect(isDone('fault', 'x', seen, now([], { state: good }))).toBe(true)
  })
  it('of undoing is done by one more change that was undone', () => {
    expect(isDone('undo', 'x', before, now())).toBe(false)
    expect(isDone('undo', 'x', before, now([], { undone: 2 }))).toBe(true)
  })
  it('comes in the order of the issue', () => {
    expect(STEPS).toEqual(['look', 'jog', 'response', 'tune', 'fault', 'undo', 'end'])
  })
})
