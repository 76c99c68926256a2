// @vitest-environment happy-dom
import { sent, serve, settled, shown } from '../../../testing/page'
import { fireEvent, screen, within } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it } from 'vitest'
import type { GainInfo, MeasurementInfo } from '../../../api/schema'
import { CandidatesPanel } from './CandidatesPanel'

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
  shown(
    <CandidatesPanel
      drive="x"
      name="X"
      list={list}
      gains={{ inertia_kgm2: null } as GainInfo}
      inertia={inertia}
      onApplied={() => Promise.resolve()}
    />,
  )
const button = (name: string) => screen.getByRole<HTMLButtonElement>('button', { name })
const design = async () => {
  await userEvent.click(button('Compute designs'))
  await settled()
}
const write = async () => {
  const dialog = screen.getByRole('dialog', { name: 'Apply' })
  await userEvent.click(within(dialog).getByRole('button', { name: 'Write' }))
  await settled()
}
const apply = async () => {
  await userEvent.click(button('Apply'))
  await write()
}
const designs = () => screen.queryByRole('table')
const half = () => screen.queryByText(/^Half written/)
const written = () => screen.queryByText(/Written, not verified yet/)

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
    const page = await panel(0.001)
    await design()
    expect(sent('/tune/candidates')?.body).toMatchObject({ measurement: 'own.sdmeas' })
    page.unmount()
    await panel(0.001, [OTHER])
    expect(button('Compute designs').disabled).toBe(true)
  })

  it('are written with the inertia that they were computed for, or not at all', async () => {
    await panel(0.001)
    await design()
    const inertia = screen.getByRole('textbox', { name: 'Inertia of the axis' })
    await userEvent.click(button('Apply'))
    // Another inertia is measured or typed before the design is confirmed.
    fireEvent.change(inertia, { target: { value: '0.004' } })
    await write()
    expect(sent('/gains')?.body).toMatchObject({ gains: { inertia_kgm2: 0.001 } })
    expect(designs()).toBeNull()
  })

  it('are not shown as those of another response or load', async () => {
    await panel(0.001)
    await design()
    expect(designs()).not.toBeNull()
    await userEvent.selectOptions(screen.getByRole('combobox', { name: 'Load' }), 'compliant')
    expect(designs()).toBeNull()
  })

  it('are not called written where the second one was refused', async () => {
    await panel(0.001)
    await design()
    await apply()
    expect(written()).not.toBeNull()
    refused = true
    await apply()
    expect(written()).toBeNull()
  })

  it('are called half written where only the notches were refused, with the way back', async () => {
    const notches = [{ center_hz: 400, width_hz: 100, depth_db: -20 }]
    let allow = false
    serve(({ method, path }) => {
      if (path.endsWith('/tune/candidates')) {
        return { load: 'stiff', candidates: [{ ...candidate, notches }] }
      }
      if (method === 'GET') return []
      if (path.endsWith('/notches') && !allow) return 409
      return { before: { '2005:03': 1 }, after: { '2005:03': 2 } }
    })
    await panel(0.001)
    await design()
    await apply()
    expect(written()).toBeNull()
    expect(half()?.textContent).toContain('the gains of this design are in force')
    expect(screen.getByText('Gains were written.')).not.toBeNull()
    await userEvent.click(button('Undo'))
    await settled()
    expect(sent('/tune/undo')?.body).toEqual({ before: { '2005:03': 1 }, after: { '2005:03': 2 } })
    expect(half()).toBeNull()
    // Applied again without a refusal, nothing is said of halves.
    await apply()
    expect(half()).not.toBeNull()
    allow = true
    await apply()
    expect(half()).toBeNull()
    expect(written()).not.toBeNull()
  })
})
