import { answers, requests } from '../../testing/browser'
import { beforeEach, expect, it } from 'vitest'
import type { AxisRecordInfo, GearPlanInfo, Mechanics } from '../../api/schema'
import { contents } from '../../live/store'
import { Shallow } from '../../testing/shallow'
import { setRecord } from '../../widgets/useFunctions'
import { GearPanel } from './GearPanel'
import { START, toMechanics } from './mechanics'

const PLAN = { counted: [], values: [], warnings: [] } as unknown as GearPlanInfo
const record = (mechanics: Mechanics | null) => ({ mechanics }) as AxisRecordInfo
const screw = (lead_mm: number) => toMechanics({ ...START, lead_mm })
let release: (() => void)[] = []

beforeEach(() => {
  contents.link = { open: false, attempt: 0, roundTripMs: null }
  setRecord('x', record(screw(10)))
  answers.splice(0)
  requests.splice(0)
  release = []
  answers.push(
    {
      method: 'POST',
      path: /gear\/plan$/,
      give: () => new Promise((done) => release.push(() => done(PLAN))),
    },
    { method: 'POST', path: /gear\/write$/, give: () => ({ before: {}, waits: {} }) },
    { method: 'GET', path: /record$/, give: () => record(screw(10)) },
  )
})

const press = (panel: Shallow<{ drive: string }>, words: string) =>
  panel.act(() => {
    const button = panel.the('Button', (props) => props.children === words)
    ;(button.props.onClick as () => void)()
  })
async function opened() {
  const panel = new Shallow(GearPanel, { drive: 'x' })
  await panel.act()
  return panel
}
const answered = (panel: Shallow<{ drive: string }>) =>
  panel.act(() => release.forEach((each) => each()))
const change = (panel: Shallow<{ drive: string }>, lead_mm: number) =>
  panel.act(() =>
    (panel.the('MechanicsFields').props.change as (part: object) => void)({ lead_mm }),
  )

it('writes what was planned', async () => {
  const panel = await opened()
  await press(panel, 'Calculate')
  await answered(panel)
  await panel.act(panel.the('PlanPanel').props.onWrite as () => void)
  await press(panel, 'Write the gear')
  const written = requests.find((each) => each.url.endsWith('/write'))
  expect(await written?.json()).toMatchObject({ lead_mm: 10 })
})

it('shows no plan of what stood in the form when it was asked for', async () => {
  const panel = await opened()
  await press(panel, 'Calculate')
  await change(panel, 5)
  await answered(panel)
  expect(panel.has('PlanPanel')).toBe(false)
})

it('shows no plan once somebody else has kept other mechanics, which fill the form', async () => {
  const panel = await opened()
  await press(panel, 'Calculate')
  await answered(panel)
  expect(panel.has('PlanPanel')).toBe(true)
  await panel.act(() => setRecord('x', record(screw(5))))
  expect(panel.has('PlanPanel')).toBe(false)
})
