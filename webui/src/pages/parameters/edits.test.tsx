// @vitest-environment happy-dom
import { asked, later, serve, settled, shown, type } from '../../testing/page'
import { fireEvent, screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it } from 'vitest'
import type { DriveSummary, ParameterRow, ParameterValue } from '../../api/schema'
import { setDrives, setReadings, setRows } from '../../live/store'
import { Editor } from './Detail'
import { discardEdits, type Edit, setEdit, useEdits, writeEdits } from './edits'
import { Grid } from './Grid'
import { ParameterTable } from './ParameterTable'

const reading = (key: string, raw: number, part: Partial<ParameterValue> = {}): ParameterValue => ({
  key,
  raw,
  value: raw / 10,
  time: '2026-11-21T10:00:00Z',
  error: '',
  pending: '',
  unsaved: false,
  unused: false,
  ...part,
})

const row = (key: string, raw: number): ParameterRow =>
  ({
    key,
    name: `Speed ${key}`,
    number: null,
    group: '',
    type: 'INT16',
    access: 'rw',
    unit: 'rpm',
    scale: 0.1,
    offset: 0,
    min_raw: -10000,
    max_raw: 10000,
    default_raw: 0,
    enum: {},
    bits: {},
    reachable: true,
    motion: 'none',
    settable: 'any',
    reading: reading(key, raw),
  }) as unknown as ParameterRow

const X = 'x'
const rows = [row('2001:00', 500), row('2002:00', 300)]
const first = rows[0]!
let edits: ReadonlyMap<string, Edit> = new Map()
let problems: ReadonlyMap<string, unknown> = new Map()
function Seen() {
  const seen = useEdits(X)
  edits = seen.edits
  problems = seen.problems
  return null
}
const grid = () =>
  shown(
    <>
      <Seen />
      <Grid
        drive={X}
        profile="p"
        rows={rows}
        asRaw={false}
        live={false}
        chosen={first.key}
        onChoose={() => {}}
      />
    </>,
  )
const cell = () => screen.getByRole('button', { name: /^Edit Speed 2001:00: / })
const editor = () => screen.getByRole<HTMLInputElement>('textbox', { name: 'Speed 2001:00' })
/** Leave the editor for something else. */
const leave = () => settled(() => editor().blur())

beforeEach(() => {
  discardEdits(X)
  setRows(X, rows)
  setReadings(X, [reading('2001:00', 500, { time: null }), reading('2002:00', 300, { time: null })])
  serve(() => 404)
})

describe('a raw edit among values in their unit', () => {
  it('keeps its scale when its cell is opened and left', async () => {
    await grid()
    await settled(() => setEdit(X, first.key, { text: '600', asRaw: true }))
    await userEvent.click(cell())
    await leave()
    expect(edits.get(first.key)).toEqual({ text: '600', asRaw: true })
    await userEvent.click(cell())
    // The cell is in the unit of its column, whatever the edit was.
    expect(editor().value).toBe('60')
    await type(editor(), '70')
    await leave()
    expect(edits.get(first.key)).toEqual({ text: '70', asRaw: false })
  })

  it('is not shown as if it were in the unit', async () => {
    await grid()
    await settled(() => setEdit(X, first.key, { text: '600', asRaw: true }))
    // 600 raw are 60 rpm; the column beside it says rpm.
    expect(cell().textContent).toBe('50 60')
  })

  it('is edited as raw in an editor that was open already', async () => {
    await shown(
      <>
        <Seen />
        <Editor drive={X} row={first} />
      </>,
    )
    await settled(() => setEdit(X, first.key, { text: '600', asRaw: true }))
    expect(screen.getByRole<HTMLInputElement>('checkbox').checked).toBe(true)
    await type(screen.getByRole('textbox'), '650')
    expect(edits.get(first.key)).toEqual({ text: '650', asRaw: true })
  })
})

describe('a cell that is opened and left', () => {
  it('edits nothing, although the value has changed meanwhile', async () => {
    await grid()
    fireEvent.keyDown(screen.getByRole('grid'), { key: 'F2' })
    expect(editor().value).toBe('50')
    await settled(() => setReadings(X, [reading(first.key, 510, { time: '2026-11-21T10:00:09Z' })]))
    await leave()
    expect(edits.size).toBe(0)
  })
})

describe('writing', () => {
  const answer = (keys: string[]) =>
    keys.map((each) => ({ key: each, ok: true, reading: reading(each, 600), problem: null }))

  it('keeps what was typed while the value before it was written', async () => {
    const written = later<object>()
    serve(() => written.promise)
    await shown(<Seen />)
    await settled(async () => {
      setEdit(X, first.key, { text: '60', asRaw: false })
      const done = writeEdits(X, [first.key])
      setEdit(X, first.key, { text: '75', asRaw: false })
      written.give(answer([first.key]))
      await done
    })
    expect(edits.get(first.key)).toEqual({ text: '75', asRaw: false })
  })

  it('reports by the keyboard what it reports by the button', async () => {
    serve(() => 409)
    await grid()
    await settled(() => setEdit(X, first.key, { text: '60', asRaw: false }))
    fireEvent.keyDown(screen.getByRole('grid'), { key: 'Enter', ctrlKey: true })
    await settled()
    expect(asked.map((each) => each.method)).toEqual(['PUT'])
    expect(edits.has(first.key)).toBe(true)
    expect(problems.has(first.key)).toBe(true)
  })
})

describe('values typed for a drive that has gone', () => {
  const drive = (serial: number) =>
    ({ id: X, name: 'X', profile: 'p', serial, ports: [], unsaved: 0, pending: 0 }) as unknown as
      DriveSummary // prettier-ignore

  it('are dropped with a notice, and not written to the one that has its id now', async () => {
    setDrives([drive(1)])
    setRows(X, rows)
    setEdit(X, '2001:00', { text: '60', asRaw: false })
    setEdit(X, '2002:00', { text: '31', asRaw: false })
    await shown(
      <>
        <Seen />
        <ParameterTable drive={drive(2)} rows={rows} asked={null} />
      </>,
    )
    await settled(() => setDrives([drive(2)]))
    expect(edits.size).toBe(0)
    expect(screen.getByText(/^2 typed values were dropped/)).not.toBeNull()
    await settled(() => writeEdits(X, ['2001:00', '2002:00']))
    expect(asked.some((each) => each.method === 'PUT')).toBe(false)
    await userEvent.click(screen.getByRole('button', { name: 'Close' }))
    expect(screen.queryByText(/typed values were dropped/)).toBeNull()
  })

  it('are not written on where it goes in the middle of them', async () => {
    const many = Array.from({ length: 20 }, (_, i) => row(`30${String(10 + i)}:00`, 1))
    setDrives([drive(1)])
    setRows(X, many)
    for (const { key } of many) setEdit(X, key, { text: '2', asRaw: false })
    const first = later<object>()
    serve(() => first.promise)
    const writing = writeEdits(
      X,
      many.map((each) => each.key),
    )
    await settled()
    await settled(() => setDrives([drive(2)]))
    await settled(() => first.give([]))
    await writing
    expect(asked.filter((each) => each.method === 'PUT')).toHaveLength(1)
  })
})
