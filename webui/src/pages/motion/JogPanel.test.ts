import { posted } from '../../testing/browser'
import { beforeEach, expect, it } from 'vitest'
import type { AxisState } from '../../api/schema'
import { contents } from '../../live/store'
import { inside, Shallow } from '../../testing/shallow'
import { JogPanel } from './JogPanel'
import { travelUnit } from './travelUnit'

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

const kinds = () => posted.map((each) => (each as { kind: string }).kind)

/** A mouse at the button that jogs forwards. `buttons`: what is down after the event. */
async function mouse() {
  const unit = travelUnit('rev', null, STATE)
  const panel = new Shallow(JogPanel, { drive: 'x', state: STATE, unit })
  await panel.act()
  const plus = panel.the('JogButton', (props) => props.towards === 1)
  const button = inside(plus)
  const event = (kind: string, what: { button: number; buttons: number }) =>
    panel.act(() => {
      const heard = button.the('button').props[kind] as ((event: unknown) => void) | undefined
      heard?.({
        ...what,
        pointerId: 1,
        preventDefault: () => {},
        currentTarget: { setPointerCapture: () => {} },
      })
      button.update(panel.the('JogButton', (props) => props.towards === 1).props)
    })
  return { event }
}

it('jogs while the button of the mouse is down', async () => {
  const { event } = await mouse()
  await event('onPointerDown', { button: 0, buttons: 1 })
  await event('onPointerMove', { button: -1, buttons: 1 })
  expect(kinds()).toEqual(['jogStart'])
  await event('onPointerUp', { button: 0, buttons: 0 })
  expect(kinds()).toEqual(['jogStart', 'jogStop'])
})

it('stops when that button is let go while another one is held down', async () => {
  const { event } = await mouse()
  await event('onPointerDown', { button: 0, buttons: 1 })
  // A second button gives no pointerdown of its own, and the first one no pointerup.
  await event('onPointerMove', { button: 2, buttons: 3 })
  await event('onPointerMove', { button: 0, buttons: 2 })
  expect(kinds()).toEqual(['jogStart', 'jogStop'])
})
