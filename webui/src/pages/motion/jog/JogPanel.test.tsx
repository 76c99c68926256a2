// @vitest-environment happy-dom
import { posted, shown } from '../../../testing/page'
import { fireEvent, screen } from '@testing-library/react'
import { beforeEach, expect, it } from 'vitest'
import type { AxisState } from '../../../api/schema'
import { contents } from '../../../live/store'
import { JogPanel } from './JogPanel'
import { travelUnit } from '../fields/travelUnit'

const STATE = {
  drive: 'x',
  time: '2026-01-01T00:00:00Z',
  fresh: true,
  moving_job: null,
  position: 0,
  velocity: 0,
  units: { position: 'rev', velocity: 'rpm', acceleration: 'rpm/s' },
} as unknown as AxisState

beforeEach(() => {
  contents.link = { open: true, attempt: 0, roundTripMs: null }
  contents.states.set('x', STATE)
  posted.splice(0)
})

const kinds = () => posted.map(({ kind }) => kind)

/** The button that jogs forwards. `buttons` of its events: what is down after the event. */
async function plus() {
  const unit = travelUnit('rev', null, STATE)
  await shown(<JogPanel drive="x" state={STATE} unit={unit} />)
  return screen.getByRole('button', { name: /plus|forward|positive/i })
}

it('jogs while the button of the mouse is down', async () => {
  const button = await plus()
  fireEvent.pointerDown(button, { pointerId: 1, button: 0, buttons: 1 })
  fireEvent.pointerMove(button, { pointerId: 1, button: -1, buttons: 1 })
  expect(kinds()).toEqual(['jogStart'])
  fireEvent.pointerUp(button, { pointerId: 1, button: 0, buttons: 0 })
  expect(kinds()).toEqual(['jogStart', 'jogStop'])
})

it('stops when that button is let go while another one is held down', async () => {
  const button = await plus()
  fireEvent.pointerDown(button, { pointerId: 1, button: 0, buttons: 1 })
  // A second button gives no pointerdown of its own, and the first one no pointerup.
  fireEvent.pointerMove(button, { pointerId: 1, button: 2, buttons: 3 })
  fireEvent.pointerMove(button, { pointerId: 1, button: 0, buttons: 2 })
  expect(kinds()).toEqual(['jogStart', 'jogStop'])
})
