import '../testing/browser'
import { expect, it, vi } from 'vitest'
import type { JobInfo } from '../api/schema'
import { forgetServerClock, heardServerTime } from '../live/server-clock'
import { setJob } from '../live/store'
import { Shallow } from '../testing/shallow'
import { JobNote } from './JobNote'

it('counts by the clock of the server, whose times a job has', () => {
  vi.useFakeTimers()
  vi.setSystemTime(Date.parse('2026-01-01T10:30:30Z'))
  forgetServerClock()
  heardServerTime('2026-01-01T10:00:30Z')
  const words = { code: '', params: { words: 'Read' } }
  setJob({
    id: 'c',
    state: 'running',
    progress: 0.5,
    started: '2026-01-01T10:00:00Z',
    ended: null,
    title: 'Read',
    title_message: words,
    step: '',
    step_message: words,
  } as unknown as JobInfo)
  const note = new Shallow(JobNote, { id: 'c' })
  expect(note.text).toContain('30 s')
  expect(note.text).not.toContain('30:30')
  note.unmount()
  vi.useRealTimers()
})
