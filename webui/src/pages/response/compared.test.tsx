// @vitest-environment happy-dom
import { serve, settled, shown } from '../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { describe, expect, it } from 'vitest'
import type { DriveSummary } from '../../api/schema'
import { setDrives, setLink } from '../../live/store'
import { StepNumbers } from '../tune/steps/StepNumbers'
import { CursorTable } from './plot/Readings'
import { ResponsePage } from './ResponsePage'
import type { Step, Sweep } from './results'
import { ofAxis } from './useMeasurements'

const LINES = [10, 20, 40]
const sweep = (unit: string, resonance: number) => ({
  kind: 'mechanics',
  loop: 'speed',
  frequency_hz: LINES,
  magnitude_db: [0, -6, -12],
  phase_deg: [-450, -460, -470],
  coherence: [1, 1, 1],
  std_db: [null, null, null],
  std_deg: [null, null, null],
  valid_band_hz: [10, 40],
  sample_rate_hz: 4000,
  margins: {},
  unit,
  trusted: true,
  motion_s: 1,
  saturated_share: 0,
  warnings: [],
  resonances: [{ kind: 'resonance', frequency_hz: resonance, damping: 0.02, height_db: 10 }],
})
const SI = '(rad/s)/Nm'
const RATED = '(rad/s)/rated torque'
const info = (file: string, drive: string, serial: number | null) => ({
  file,
  drive,
  serial,
  kind: 'sweep-mechanics',
  profile: 'p',
  saved: '2026-11-21T10:00:00Z',
  problem: '',
})
const FILES = [
  { info: info('own', 'X', 1), result: sweep(SI, 20) },
  { info: info('before', 'X', 1), result: sweep(SI, 30) },
  { info: info('other', 'Y', 2), result: sweep(SI, 30) },
  { info: info('rated', 'X', 1), result: sweep(RATED, 30) },
]
const GAINS = {
  speed_hz: 40, integral_hz: 10, position_1_s: 30, inertia_kgm2: 0.001, raw: {}, levels: [],
} // prettier-ignore

async function read(file: string, over: string | null): Promise<string> {
  serve(({ path }) => {
    if (path === '/measurements') return FILES.map((each) => each.info)
    const found = FILES.find((each) => path === `/measurements/${each.info.file}`)
    if (found) {
      return { ...found, agrees: null, differences: [], program: '', profile_version: '', settings: {} } // prettier-ignore
    }
    return path.endsWith('/gains') ? GAINS : path === '/buses' ? [] : 404
  })
  setLink({ open: true, attempt: 0, roundTripMs: null }, 0)
  setDrives([{ id: 'x', name: 'X', profile: 'p', serial: 1, ports: [] } as unknown as DriveSummary])
  const page = await shown(<ResponsePage drive="x" />)
  await settled()
  const press = async (name: string, words: string) => {
    const row = FILES.findIndex((each) => each.info.file === name)
    await userEvent.click(screen.getAllByRole('button', { name: words })[row]!)
    await settled()
  }
  await press(file, 'Show')
  if (over) await press(over, 'Compare')
  const text = page.container.textContent
  page.unmount()
  return text
}

const LOOP = 'Try gains'

describe('a response', () => {
  it('of another axis predicts nothing for this one', async () => {
    const own = await read('own', null)
    expect(own).not.toContain('of another axis')
    expect(own).toContain(LOOP)
    const other = await read('other', null)
    expect(other).toContain('This response is of another axis')
    expect(other).not.toContain(LOOP)
  })

  it('of another axis does not say that the mechanics have changed', async () => {
    expect(await read('own', 'before')).toContain('A peak has moved')
    expect(await read('own', 'other')).not.toContain('A peak has moved')
  })

  it('in another unit is not drawn over it', async () => {
    expect(await read('own', 'before')).not.toContain('not drawn over it')
    expect(await read('own', 'rated')).toContain(`is in ${RATED}`)
  })

  it('belongs to an axis by serial number, where both have one, else by name', () => {
    const axis = { name: 'X', profile: 'p', serial: 1 }
    expect(ofAxis({ drive: 'X before', profile: 'p', serial: 1 }, axis)).toBe(true)
    expect(ofAxis({ drive: 'X', profile: 'p', serial: 2 }, axis)).toBe(false)
    expect(ofAxis({ drive: 'X', profile: 'p', serial: null }, axis)).toBe(true)
    expect(ofAxis({ drive: 'X', profile: 'q', serial: 1 }, axis)).toBe(false)
  })

  it('has the phase under a cursor that is drawn', async () => {
    const drawn = sweep(SI, 20) as unknown as Sweep
    const { container } = await shown(<CursorTable sweep={drawn} over={null} cursors={[10, 40]} />)
    // −450° is drawn as −90°.
    expect(container.textContent).toContain('−90.0°')
    expect(container.textContent).not.toContain('−450')
  })
})

describe('a step beside an earlier one', () => {
  it('has the settling window of either', async () => {
    const step = (part: object) =>
      ({ kind: 'speed', unit: 'rpm', time_s: [], demand: [], actual: [], torque_percent: [],
         step: { overshoot_percent: 1, rise_s: 0.01, settling_s: 0.02 }, move: null,
         torque_peak_percent: 1, torque_rms_percent: 1, ...part }) as unknown as Step // prettier-ignore
    const { container } = await shown(
      <StepNumbers
        step={step({ widened: false, window: 2 })}
        over={step({ widened: true, window: 12.5 })}
      />,
    )
    expect(container.textContent).toContain('12.50 rpm')
  })
})
