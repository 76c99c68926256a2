import { answers } from '../../testing/browser'
import { expect, it } from 'vitest'
import type { AxisState, DriveSummary } from '../../api/schema'
import { askBuses } from '../../live/buses'
import { contents, publish } from '../../live/store'
import { Shallow } from '../../testing/shallow'
import { MovePanel } from './MovePanel'
import { SignalPanel } from './SignalPanel'
import { travelUnit } from './travelUnit'

const STATE = {
  drive: 'x',
  time: '2026-01-01T00:00:00Z',
  fresh: true,
  moving_job: null,
  modes: [1, 3, 8, 9],
  units: { position: 'rev', velocity: 'rpm', acceleration: 'rpm/s', torque: '%' },
} as unknown as AxisState
const DRIVE = { id: 'x', ports: [{ url: 'e' }] } as unknown as DriveSummary

contents.link = { open: true, attempt: 0, roundTripMs: null }
contents.states.set('x', STATE)
publish('link')

async function opened(of: typeof MovePanel | typeof SignalPanel, state = STATE) {
  const unit = travelUnit('rev', null, state)
  const panel = new Shallow(of, { drive: DRIVE, state, unit, onStarted: () => {} })
  await panel.act()
  const field = (label: string) => panel.the('NumberField', (props) => props.label === label)
  const choose = (mode: string) =>
    panel.act(() => (panel.the('SegmentedControl').props.onChange as (m: string) => void)(mode))
  const type = (label: string, value: number | null) =>
    panel.act(() => (field(label).props.onChange as (v: number | null) => void)(value))
  const obstacle = () => panel.the('StartButton').props.obstacle
  return { panel, field, choose, type, obstacle }
}

it('leaves no target of one mode standing in the field of another', async () => {
  const { field, choose } = await opened(MovePanel)
  const before = field('Target').key
  await choose('PV')
  expect(field('Target').key).not.toBe(before)
})

it('moves in a mode that the drive has', async () => {
  const { panel } = await opened(MovePanel, { ...STATE, modes: [3] })
  expect(panel.the('SegmentedControl').props.value).toBe('PV')
})

it('asks only for the numbers that the shape of a signal has', async () => {
  answers.push({
    method: 'GET',
    path: /buses$/,
    give: () => [{ url: 'e', cyclic_possible: true, cyclic: { running: true } }],
  })
  await askBuses()
  const { panel, field, choose, type, obstacle } = await opened(SignalPanel)
  const before = field('Amplitude').key
  await choose('CSP')
  expect(field('Amplitude').key).not.toBe(before)
  await type('Frequency', null)
  await panel.act(() =>
    (panel.the('NativeSelect').props.onChange as (event: object) => void)({
      currentTarget: { value: 'step' },
    }),
  )
  await type('Amplitude', 1)
  expect(obstacle()).toBeNull()
})
