// @vitest-environment happy-dom
import { shown } from '../../testing/page'
import { screen } from '@testing-library/react'
import { expect, it, vi } from 'vitest'
import type { JobInfo } from '../../api/schema'
import { forgetServerClock, heardServerTime } from '../../live/server-clock'
import { setJob } from '../../live/store'
import { JobNote } from './JobNote'

it('counts by the clock of the server, whose times a job has', async () => {
  vi.useFakeTimers({ toFake: ['Date'] })
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
  await shown(<JobNote id="c" />)
  const note = screen.getByRole('status').textContent
  expect(note).toContain('30 s')
  expect(note).not.toContain('30:30')
  vi.useRealTimers()
})
