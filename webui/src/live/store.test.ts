import { describe, expect, it } from 'vitest'
import type { AxisState, JobInfo, ParameterValue } from '../api/schema'
import { contents, setJob, setReadings, setState } from './store'

const job = (state: JobInfo['state']): JobInfo => ({
  id: 'j1',
  kind: 'read_all',
  drive: 'x',
  title: 'Read X',
  state,
  progress: state === 'running' ? 0 : 1,
  step: '',
  started: '2026-01-01T00:00:00Z',
  ended: state === 'running' ? null : '2026-01-01T00:00:01Z',
  motion: false,
  result: null,
  problem: null,
})

const reading = (raw: number, time: string): ParameterValue => ({
  key: '6083:00',
  raw,
  value: raw,
  time,
  error: '',
  unsaved: false,
  pending: '',
})

describe('the store', () => {
  it('does not let a late answer to a start revive a job that has ended', () => {
    setJob(job('done'))
    setJob(job('running'))
    expect(contents.jobs.get('j1')?.state).toBe('done')
  })
  it('keeps the newer of two readings, whichever came first', () => {
    setReadings('x', [reading(2, '2026-01-01T00:00:02Z')])
    setReadings('x', [reading(1, '2026-01-01T00:00:01Z')])
    expect(contents.readings.get('x')?.get('6083:00')?.raw).toBe(2)
  })
  it('keeps the newer of two states, whichever came first', () => {
    const state = (time: string, word: string) => ({ drive: 'x', time, state: word }) as AxisState
    setState(state('2026-01-01T00:00:02Z', 'Fault'))
    setState(state('2026-01-01T00:00:01Z', 'Operation enabled'))
    expect(contents.states.get('x')?.state).toBe('Fault')
  })
})
