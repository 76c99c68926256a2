import { asked, serve } from '../../../testing/bench'
import { createElement } from 'react'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { GainInfo, MeasurementInfo } from '../../../api/schema'
import { type Drawn, Page, press, type } from '../../../testing/render'
import { CandidatesPanel } from './CandidatesPanel'
import { newestInertia } from './newest'

vi.mock('@mantine/core', () => import('../../../testing/mantine'))

const measured = (file: string, drive: string) =>
  ({ file, drive, kind: 'sweep-mechanics', saved: null }) as MeasurementInfo
const OWN = measured('own.sdmeas', 'X')
const OTHER = measured('other.sdmeas', 'Y')
const candidate = {
  marks: ['balanced'],
  gains: { speed_bandwidth_hz: 40, integral_hz: 10, position_1_s: 60 },
  notches: [],
  promised: {},
  phase_cost_deg: 0,
  settling_s: null,
}
let refused = false

const panel = (inertia: number, list = [OTHER, OWN]) =>
  createElement(CandidatesPanel, {
    drive: 'x',
    name: 'X',
    list,
    gains: { inertia_kgm2: null } as GainInfo,
    inertia,
    onApplied: () => Promise.resolve(),
  })
const inertiaField = (page: Page): Drawn =>
  page.one((each) => each.type === 'TextInput' && each.props.className === 'number-field')
const design = (page: Page) =>
  page.after(() => press(page.named('Button', 'Compute designs'), 'onClick'))
const apply = async (page: Page) => {
  await page.after(() => press(page.named('Button', 'Apply')))
  await page.after(() => press(page.named('Button', 'Write')))
}
const sent = (path: string) => asked.filter((each) => each.path.endsWith(path)).at(-1)?.body

beforeEach(() => {
  refused = false
  serve(({ method, path }) => {
    if (path.endsWith('/tune/candidates')) return { load: 'stiff', candidates: [candidate] }
    if (method === 'GET') return []
    if (refused) return 409
    return { before: { '2005:03': 1 }, after: { '2005:03': 2 } }
  })
})

describe('designs of a stored response', () => {
  it('are of this axis, not of another of its family that was measured later', async () => {
    const page = new Page(panel(0.001))
    await design(page)
    expect(sent('/tune/candidates')).toMatchObject({ measurement: 'own.sdmeas' })
    const alone = new Page(panel(0.001, [OTHER]))
    expect(alone.named('Button', 'Compute designs').props.disabled).toBe(true)
  })

  it('are written with the inertia that they were computed for, or not at all', async () => {
    const page = new Page(panel(0.001))
    await design(page)
    await page.after(() => press(page.named('Button', 'Apply')))
    expect(page.one('Modal').props.children).toBeDefined()
    // Another inertia is measured or typed before the design is confirmed.
    await page.after(() => type(inertiaField(page), '0.004'))
    await page.after(() => press(page.named('Button', 'Write')))
    expect(sent('/gains')).toMatchObject({ gains: { inertia_kgm2: 0.001 } })
    expect(page.all((each) => each.props.className === 'designs')).toEqual([])
  })

  it('are not shown as those of another response or load', async () => {
    const page = new Page(panel(0.001))
    await design(page)
    expect(page.all((each) => each.props.className === 'designs')).toHaveLength(1)
    await page.after(() => type(page.named('NativeSelect', 'Load'), 'compliant'))
    expect(page.all((each) => each.props.className === 'designs')).toEqual([])
  })

  it('are not called written where the second one was refused', async () => {
    const page = new Page(panel(0.001))
    await design(page)
    await apply(page)
    expect(page.text()).toContain('Written, not verified yet')
    refused = true
    await apply(page)
    expect(page.text()).not.toContain('Written, not verified yet')
  })
})

describe('the inertia of an axis', () => {
  const inertia = (inertia_kgm2: number) => ({
    inertia_kgm2,
    ci95: {},
    verdict: '',
    identifiable: true,
    unit: 'SI',
  })
  const alone = { started: '2026-11-21T10:00:00Z', result: inertia(0.001) }
  const tuning = (started: string) => ({
    started,
    result: { mechanics: {}, candidates: [], before: {}, inertia: inertia(0.002) },
  })
  const of = (...jobs: object[]) =>
    newestInertia(...(jobs as unknown as Parameters<typeof newestInertia>))

  it('is that of the newest measurement', () => {
    expect(of(alone, tuning('2026-11-21T11:00:00Z'))?.inertia_kgm2).toBe(0.002)
    expect(of(alone, tuning('2026-11-21T09:00:00Z'))?.inertia_kgm2).toBe(0.001)
    // One that failed or still runs has none.
    expect(of({ ...alone, result: null }, tuning('2026-11-21T09:00:00Z'))?.inertia_kgm2).toBe(0.002)
  })
})
