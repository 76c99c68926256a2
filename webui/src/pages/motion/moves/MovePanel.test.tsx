// @vitest-environment happy-dom
import { serve, settled, shown, type } from '../../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { expect, it } from 'vitest'
import type { AxisState, DriveSummary } from '../../../api/schema'
import { askBuses } from '../../../live/buses'
import { contents, publish } from '../../../live/store'
import { MovePanel } from './MovePanel'
import { SignalPanel } from './SignalPanel'
import { travelUnit } from '../fields/travelUnit'

const STATE = {
  drive: 'x',
  time: '2026-01-01T00:00:00Z',
  fresh: true,
  moving_job: null,
  modes: [1, 3, 8, 9],
  units: { position: 'rev', velocity: 'rpm', acceleration: 'rpm/s', torque: '%' },
} as unknown as AxisState
const DRIVE = { id: 'x', ports: [{ url: 'e', cyclic: true }] } as unknown as DriveSummary

contents.link = { open: true, attempt: 0, roundTripMs: null }
contents.states.set('x', STATE)
publish('link')

function opened(Panel: typeof MovePanel | typeof SignalPanel, state = STATE) {
  const unit = travelUnit('rev', null, state)
  return shown(<Panel drive={DRIVE} state={state} unit={unit} onStarted={() => {}} />)
}
const field = (name: string) => screen.getByRole<HTMLInputElement>('textbox', { name })
const mode = (name: string) => screen.getByRole<HTMLInputElement>('radio', { name })

it('leaves no target of one mode standing in the field of another', async () => {
  await opened(MovePanel)
  await type(field('Target'), '5')
  expect(field('Target').value).toBe('5')
  await userEvent.click(mode('Speed'))
  expect(mode('Speed').checked).toBe(true)
  expect(field('Target').value).toBe('')
})

it('moves in a mode that the drive has', async () => {
  await opened(MovePanel, { ...STATE, modes: [3] })
  expect(mode('Speed').checked).toBe(true)
  expect(screen.queryByRole('radio', { name: 'Position' })).toBeNull()
})

it('asks only for the numbers that the shape of a signal has', async () => {
  serve(({ path }) =>
    path === '/buses' ? [{ url: 'e', cyclic_possible: true, cyclic: { running: true } }] : 404,
  )
  await askBuses()
  await opened(SignalPanel)
  await type(field('Amplitude'), '7')
  await userEvent.click(mode('Position'))
  expect(field('Amplitude').value).toBe('')
  await type(field('Frequency'), '')
  await type(field('Amplitude'), '1')
  const start = screen.getByRole('button', { name: 'Start the signal' })
  expect(start.getAttribute('aria-disabled')).toBe('true')
  await userEvent.selectOptions(screen.getByRole('combobox', { name: 'Shape' }), 'step')
  expect(start.getAttribute('aria-disabled')).toBe('false')
  await settled()
})

it.each([
  ['a move', MovePanel],
  ['a test signal', SignalPanel],
])('warns of %s next to its start, also while a limit is typed', async (_, panel) => {
  await opened(panel)
  const warning = () => screen.getByText(/^WARNING: the axis is enabled/).textContent
  expect(warning()).toMatch(/at most \d+ rev .* at most \d+ % of rated torque/)
  await userEvent.clear(field('Travel limit'))
  expect(warning()).toContain('at most … rev')
})
