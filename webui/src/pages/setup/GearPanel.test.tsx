// @vitest-environment happy-dom
import { sent, serve, settled, shown, type } from '../../testing/page'
import { screen, within } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, expect, it } from 'vitest'
import type { AxisRecordInfo, GearPlanInfo, Mechanics } from '../../api/schema'
import { contents } from '../../live/store'
import { setRecord } from '../../widgets/drive/useFunctions'
import { GearPanel } from './GearPanel'
import { START, toMechanics } from './mechanics'

const VALUE = { key: 'k', name: 'Numerator', now: 1, raw: 2 }
const PLAN = {
  counted: [],
  values: [VALUE],
  warnings: [],
  travel_per_motor_turn: 10,
  reached: 1000,
  error_ppm: 0,
  encoder_travel: 0.01,
  max_speed: null,
  max_speed_rpm: null,
  range_travel: 1000,
  unit: 'mm',
} as unknown as GearPlanInfo
const record = (mechanics: Mechanics | null) => ({ mechanics }) as AxisRecordInfo
const screw = (lead_mm: number) => toMechanics({ ...START, lead_mm })
let release: (() => void)[] = []

beforeEach(() => {
  contents.link = { open: false, attempt: 0, roundTripMs: null }
  setRecord('x', record(screw(10)))
  release = []
  serve(({ path }) =>
    path.endsWith('/gear/plan')
      ? new Promise<GearPlanInfo>((done) => release.push(() => done(PLAN)))
      : path.endsWith('/gear/write')
        ? { before: {}, waits: {} }
        : path.endsWith('/record')
          ? record(screw(10))
          : 404,
  )
})

const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))
const answered = () => settled(() => release.forEach((each) => each()))
const plan = () => screen.queryByRole('heading', { name: 'Result' })

it('writes what was planned', async () => {
  await shown(<GearPanel drive="x" />)
  await press('Calculate')
  await answered()
  await press('Write the gear')
  const dialog = await screen.findByRole('dialog', { name: 'Write the gear' })
  expect(sent('/gear/write')).toBeUndefined()
  await userEvent.click(within(dialog).getByRole('button', { name: 'Write the gear' }))
  await settled()
  expect(sent('/gear/write')?.body).toMatchObject({ lead_mm: 10 })
})

it('shows no plan of what stood in the form when it was asked for', async () => {
  await shown(<GearPanel drive="x" />)
  await press('Calculate')
  await type(screen.getByRole('textbox', { name: 'Lead' }), '5')
  await answered()
  expect(release).toHaveLength(1)
  expect(plan()).toBeNull()
})

it('shows no plan once somebody else has kept other mechanics, which fill the form', async () => {
  await shown(<GearPanel drive="x" />)
  await press('Calculate')
  await answered()
  expect(plan()).not.toBeNull()
  await settled(() => setRecord('x', record(screw(5))))
  expect(plan()).toBeNull()
})
