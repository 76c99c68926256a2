import { answers, requests } from '../../testing/browser'
import { beforeEach, expect, it } from 'vitest'
import type { DriveSummary, MissingPort, SegmentStation } from '../../api/schema'
import { inside, Shallow } from '../../testing/shallow'
import { MissingPorts } from './MissingPorts'
import { StationPanel } from './segment/StationPanel'

const station = (part: Partial<SegmentStation>) =>
  ({
    station: 1,
    vendor_id: 1,
    product_code: 1,
    revision: 1,
    serial: 100,
    ports: [],
    notes: [],
    error: '',
    foe: true,
    drive: 'x',
    ...part,
  }) as unknown as SegmentStation

const keys = (shown: SegmentStation) => {
  const panel = new Shallow(StationPanel, { url: 'ethercat://eth0', station: shown })
  return ['Alias', 'Eeprom', 'Firmware'].map((name) => panel.the(name).key)
}

it('carries file and consent of one slave over to no other one', () => {
  const first = keys(station({}))
  for (const other of [station({ station: 2 }), station({ serial: 101 })]) {
    for (const [i, key] of keys(other).entries()) expect(key).not.toBe(first[i])
  }
  expect(keys(station({ alias: 7 }))).toEqual(first)
})

const DRIVE = { id: 'x', ports: [{ kind: 'ethercat', url: 'e', station: 1 }] } as DriveSummary
const PORT = { kind: 'modbus', parameters: 3, groups: [], wiring: '' } as unknown as MissingPort

beforeEach(() => {
  requests.splice(0)
  answers.splice(0)
  answers.push(
    { method: 'GET', path: /missing-ports$/, give: () => [PORT] },
    {
      method: 'POST',
      path: /ports$/,
      give: () =>
        Response.json(
          {
            type: 'urn:servodeck:differs',
            title: '',
            status: 409,
            detail: '',
            parameter: '2001:01',
          },
          { status: 409 },
        ),
    },
  )
})

it('offers to accept a difference only at the port at which it was found', async () => {
  const ports = new Shallow(MissingPorts, { drive: DRIVE })
  await ports.act()
  const port = inside(ports.the('Missing'))
  const type = (url: string) =>
    port.act(() =>
      (port.the('TextInput').props.onChange as (event: object) => void)({
        currentTarget: { value: url },
      }),
    )
  const buttons = () => port.all('Button').map((each) => each.props)
  const press = (place: number) => port.act(buttons()[place]?.onClick as () => void)
  await type('modbus:///dev/ttyUSB0')
  await press(0)
  expect(buttons()).toHaveLength(2)
  await type('modbus:///dev/ttyUSB1')
  expect(buttons()).toHaveLength(1)
  await press(0)
  await press(1)
  expect(await requests.at(-1)?.json()).toMatchObject({
    url: 'modbus:///dev/ttyUSB1',
    accept_difference: true,
  })
})
