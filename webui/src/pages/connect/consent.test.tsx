// @vitest-environment happy-dom
import { refusal, sent, serve, settled, shown, type } from '../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, expect, it } from 'vitest'
import type { DriveSummary, MissingPort, SegmentStation } from '../../api/schema'
import { MissingPorts } from './bench/MissingPorts'
import { StationPanel } from './segment/StationPanel'

const station = (part: Partial<SegmentStation>) =>
  ({
    station: 1,
    vendor_id: 1,
    product_code: 1,
    revision: 1,
    serial: 100,
    alias: 0,
    ports: [],
    notes: [],
    error: '',
    foe: true,
    drive: 'x',
    ...part,
  }) as unknown as SegmentStation

const DRIVE = { id: 'x', ports: [{ kind: 'ethercat', url: 'e', station: 1 }] } as DriveSummary
const PORT = { kind: 'modbus', parameters: 3, groups: [], wiring: '' } as unknown as MissingPort

beforeEach(() =>
  serve(({ method, path }) =>
    path.endsWith('/missing-ports')
      ? [PORT]
      : method === 'POST' && path.endsWith('/ports')
        ? refusal(409, { parameter: '2001:01' })
        : 404,
  ),
)

/** One in each form of a slave: alias, EEPROM, firmware. */
const CONSENTS = [
  'I want to change the EEPROM',
  'The file belongs to exactly this drive, although the drive reports no identity',
  'This is the right file, and nothing will be switched off',
]
const consents = () => CONSENTS.map((name) => screen.getByLabelText<HTMLInputElement>(name).checked)

it('carries file and consent of one slave over to no other one', async () => {
  const panel = (part: Partial<SegmentStation>) => (
    <StationPanel url="ethercat://eth0" station={station(part)} />
  )
  for (const other of [{ station: 2 }, { serial: 101 }]) {
    const page = await shown(panel({}))
    for (const summary of ['Write alias', 'EEPROM', 'Load firmware']) {
      await userEvent.click(screen.getByText(summary, { selector: 'summary' }))
    }
    for (const name of CONSENTS) await userEvent.click(screen.getByLabelText(name))
    const files = page.container.querySelectorAll<HTMLInputElement>('input[type=file]')
    await userEvent.upload([...files].at(-1)!, new File(['1'], 'drive.efw'))
    expect(screen.queryByText('drive.efw')).not.toBeNull()
    page.rerender(panel({ alias: 7 }))
    expect(consents()).toEqual([true, true, true])
    expect(screen.queryByText('drive.efw')).not.toBeNull()
    page.rerender(panel(other))
    expect(consents()).toEqual([false, false, false])
    expect(screen.queryByText('drive.efw')).toBeNull()
    page.unmount()
  }
})

it('offers to accept a difference only at the port at which it was found', async () => {
  await shown(<MissingPorts drive={DRIVE} />)
  await userEvent.click(screen.getByText(/Not connected over Modbus/))
  const url = screen.getByLabelText('Bus URL')
  const press = async (name: string) => {
    await userEvent.click(screen.getByText(name))
    await settled()
  }
  const offered = () => screen.queryByText('It is the same drive: connect anyway')
  await type(url, 'modbus:///dev/ttyUSB0')
  await press('Connect Modbus too')
  expect(offered()).not.toBeNull()
  await type(url, 'modbus:///dev/ttyUSB1')
  expect(offered()).toBeNull()
  await press('Connect Modbus too')
  await press('It is the same drive: connect anyway')
  expect(sent('/ports')?.body).toMatchObject({
    url: 'modbus:///dev/ttyUSB1',
    accept_difference: true,
  })
})
