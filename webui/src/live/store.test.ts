import { describe, expect, it } from 'vitest'
import type { AxisState, DriveSummary, JobInfo, ParameterRow, ParameterValue } from '../api/schema'
import {
  askedAgain,
  contents,
  endForgotten,
  FORGOTTEN,
  setDrives,
  setJob,
  setLink,
  setReadings,
  setRows,
  setState,
  subscribe,
  whenGone,
} from './store'

const job = (state: JobInfo['state']): JobInfo => ({
  id: 'j1',
  kind: 'read_all',
  drive: 'x',
  title: 'Read X',
  title_message: { code: '', params: { words: 'Read X' } },
  step_message: { code: '', params: { words: '' } },
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
  unused: false,
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
  it('takes nothing for current once the connection is lost, until the server says it again', () => {
    const open = { open: true, attempt: 0, roundTripMs: null }
    const state = (time: string) =>
      ({ drive: 'y', time, state: 'Operation enabled', fresh: true }) as AxisState
    setLink(open, 1000)
    setState(state('2026-01-01T00:00:01Z'))
    setLink({ ...open, open: false, attempt: 1 }, 2000)
    setLink({ ...open, open: false, attempt: 2 }, 3000)
    expect(contents.states.get('y')?.fresh).toBe(false)
    expect(contents.lostAt).toBe(2000)
    setLink(open, 4000)
    expect(contents.lostAt).toBeNull()
    expect(contents.states.get('y')?.fresh).toBe(false)
    setState(state('2026-01-01T00:00:05Z'))
    expect(contents.states.get('y')?.fresh).toBe(true)
  })
  it('follows a server whose clock was set back, and no answer that was only overtaken', () => {
    const state = (time: string, word: string) => ({ drive: 'z', time, state: word }) as AxisState
    setState(state('2026-01-01T10:00:00Z', 'Operation enabled'), true)
    setState(state('2026-01-01T09:00:00Z', 'Switched on'))
    expect(contents.states.get('z')?.state).toBe('Operation enabled')
    setState(state('2026-01-01T09:59:59Z', 'Switched on'), true)
    expect(contents.states.get('z')?.state).toBe('Operation enabled')
    setState(state('2026-01-01T09:00:01Z', 'Fault'), true)
    expect(contents.states.get('z')?.state).toBe('Fault')
    setReadings('z', [reading(1, '2026-01-01T10:00:00Z')], true)
    setReadings('z', [reading(2, '2026-01-01T09:00:00Z')], true)
    expect(contents.readings.get('z')?.get('6083:00')?.raw).toBe(2)
  })
  it('takes times without fractions of a second for what they are', () => {
    const state = (time: string, word: string) => ({ drive: 'w', time, state: word }) as AxisState
    setState(state('2026-01-01T10:00:00Z', 'Switched on'), true)
    setState(state('2026-01-01T10:00:00.500000Z', 'Operation enabled'), true)
    expect(contents.states.get('w')?.state).toBe('Operation enabled')
  })
  it('takes what a restarted server says, whatever its clock', () => {
    const open = { open: true, attempt: 0, roundTripMs: null }
    const state = (time: string) => ({ drive: 'v', time, fresh: true }) as AxisState
    setLink(open, 0)
    setState(state('2026-01-01T10:00:00Z'), true)
    setReadings('v', [reading(1, '2026-01-01T10:00:00Z')])
    setLink({ ...open, open: false, attempt: 1 }, 1)
    setLink(open, 2)
    setState(state('2026-01-01T09:59:58Z'), true)
    setReadings('v', [{ ...reading(1, ''), raw: null, value: null, time: null }])
    expect(contents.states.get('v')?.fresh).toBe(true)
    expect(contents.readings.get('v')?.get('6083:00')?.raw).toBeNull()
  })
  it('keeps nothing of a drive that is gone, whose id another one may get', () => {
    const drive = (id: string, profile: string) => ({ id, profile }) as DriveSummary
    const fill = (id: string) => {
      setState({ drive: id, time: '2026-01-01T10:00:00Z', fresh: true } as AxisState)
      setRows(id, [{ key: '6083:00', reading: reading(1, '2026-01-01T10:00:00Z') } as ParameterRow])
    }
    const gone: string[] = []
    whenGone((id) => gone.push(id))
    expect(setDrives([drive('a', 'p'), drive('b', 'p')])).toEqual([])
    fill('a')
    fill('b')
    expect(setDrives([drive('a', 'p'), drive('b', 'p')])).toEqual([])
    expect(contents.rows.has('a')).toBe(true)
    expect(setDrives([drive('b', 'other')])).toEqual(['b'])
    expect([contents.rows.has('a'), contents.states.has('a'), contents.readings.has('b')]).toEqual([
      false,
      false,
      false,
    ])
    expect(gone).toEqual(['a', 'b'])
  })
  it('distinguishes drives with the same id by serial number, else by place', () => {
    const gone: string[] = []
    whenGone((id) => gone.push(id))
    const one = (serial: number | null, ...stations: number[]) => {
      const ports = stations.map((station) => ({ url: 'u', station }))
      setDrives([{ id: 's', profile: 'p', serial, ports } as unknown as DriveSummary])
      return gone.splice(0)
    }
    setDrives([])
    gone.splice(0)
    expect(one(null, 1)).toEqual([])
    expect(one(7, 1)).toEqual([])
    // Not answering, it has no number, and then the same one, or another.
    expect(one(null, 1)).toEqual([])
    expect(one(7, 2)).toEqual([])
    expect(one(null, 2)).toEqual([])
    expect(one(8, 2)).toEqual(['s'])
    setDrives([])
    gone.splice(0)
    expect(one(null, 1, 5)).toEqual([])
    expect(one(null, 5)).toEqual([])
    expect(one(null, 6)).toEqual(['s'])
  })
  it('ends jobs that the server has forgotten, and no others', () => {
    setJob({ ...job('running'), id: 'old' })
    setJob({ ...job('running'), id: 'kept' })
    setJob({ ...job('running'), id: 'begun since' })
    endForgotten(['old', 'kept'], [{ ...job('running'), id: 'kept' }])
    expect(contents.jobs.get('old')).toMatchObject({
      state: 'failed',
      problem: { type: FORGOTTEN },
    })
    expect(contents.jobs.get('kept')?.state).toBe('running')
    expect(contents.jobs.get('begun since')?.state).toBe('running')
  })
})

describe('a refusal', () => {
  it('is over when the same is asked for again, and only then', () => {
    const problem = { type: 'urn:servodeck:forbidden', title: 'Forbidden', status: 403, detail: '' }
    contents.refused = { request: 'jog_start', problem, at: 0 }
    askedAgain('watch')
    expect(contents.refused).not.toBeNull()
    let reported = 0
    const end = subscribe('refused', () => reported++)
    askedAgain('jog_start')
    end()
    expect([contents.refused, reported]).toEqual([null, 1])
  })
})
