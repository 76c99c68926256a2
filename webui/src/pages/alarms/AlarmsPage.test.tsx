// @vitest-environment happy-dom
import { serve, shown } from '../../testing/page'
import { screen } from '@testing-library/react'
import { expect, it } from 'vitest'
import type { LogEntry } from '../../api/schema'
import { setLanguage } from '../../i18n'
import { load } from '../../i18n/message'
import { addLog, contents } from '../../live/store'
import { AlarmsPage } from './AlarmsPage'

it('says the log in the language of the page', async () => {
  await load('zh')
  setLanguage('zh')
  contents.link = { open: true, attempt: 0, roundTripMs: null }
  const message = { code: 'axis.stop-pressed', params: { drive: 'X' } }
  const entry = (time: string) =>
    ({ time, level: 'warning', drive: 'x', person: '', text: 'X: STOP', message }) as LogEntry
  serve(({ path }) => (path === '/drives/x/log' ? [entry('2026-01-01T00:00:00Z')] : 404))
  addLog([entry('2026-01-01T00:00:01Z')])
  await shown(<AlarmsPage drive="x" />)
  // One was stored, the other has arrived since.
  expect(await screen.findAllByText('X：已按下“停止”（STOP）')).toHaveLength(2)
  expect(screen.queryByText('X: STOP')).toBeNull()
})
