import { answers } from '../../testing/browser'
import { expect, it } from 'vitest'
import type { LogEntry } from '../../api/schema'
import { addLog, contents } from '../../live/store'
import { inside, Shallow } from '../../testing/shallow'
import { AlarmsPage } from './AlarmsPage'

it('says the log in the language of the page', async () => {
  contents.link = { open: true, attempt: 0, roundTripMs: null }
  const message = { code: 'station.stop-pressed', params: {} }
  const entry = (time: string) =>
    ({ time, level: 'warning', drive: 'x', person: '', text: 'STOP', message }) as LogEntry
  answers.push({ method: 'GET', path: /\/log$/, give: () => [entry('2026-01-01T00:00:00Z')] })
  addLog([entry('2026-01-01T00:00:01Z')])
  const page = new Shallow(AlarmsPage, { drive: 'x' })
  const log = inside(page.the('Log'))
  await log.act()
  expect(log.all('Said').map(({ props }) => props.message)).toEqual([message, message])
})
