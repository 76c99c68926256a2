// @vitest-environment happy-dom
import { sent, serve, settled, shown, type } from '../../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, expect, it } from 'vitest'
import type { AxisState, HomingMethodInfo } from '../../../api/schema'
import { contents } from '../../../live/store'
import { HomingPanel } from './HomingPanel'
import { travelUnit } from '../fields/travelUnit'

const METHOD = { method: 1, name: 'Limit switch', help: '', notes: '', source: '' }
const STATE = {
  drive: 'x',
  time: '2026-01-01T00:00:00Z',
  fresh: true,
  moving_job: null,
  units: { position: 'rev', velocity: 'rpm', acceleration: 'rpm/s' },
} as unknown as AxisState

beforeEach(() => {
  contents.link = { open: true, attempt: 0, roundTripMs: null }
  contents.states.set('x', STATE)
  serve(({ path }) =>
    path.endsWith('/homing-methods')
      ? [METHOD as HomingMethodInfo]
      : path.endsWith('/jobs/home')
        ? { id: 'j', state: 'running' }
        : 404,
  )
})

it('starts no homing while an optional speed is not a number', async () => {
  await shown(<HomingPanel drive="x" unit={travelUnit('rev', null, STATE)} onStarted={() => {}} />)
  const speed = screen.getByRole('textbox', { name: 'Speed during search for switch' })
  const start = screen.getByRole('button', { name: 'Start homing' })
  const dim = () => start.getAttribute('aria-disabled')
  expect(dim()).toBe('false')
  for (const text of ['1o0', '-', '0', '1e400']) {
    await type(speed, text)
    expect(dim(), text).toBe('true')
    await userEvent.click(start)
    expect(screen.getByText('Not started.').parentElement?.textContent, text).toContain(
      'not allowed',
    )
    expect(sent('/jobs/home'), text).toBeUndefined()
  }
  await type(speed, '')
  expect(dim()).toBe('false')
  await type(speed, '100')
  expect(dim()).toBe('false')
  await userEvent.click(start)
  await settled()
  expect(sent('/jobs/home')?.body).toMatchObject({ speed_switch: 100, speed_zero: null })
})
