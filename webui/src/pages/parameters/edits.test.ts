import { asked, later, serve } from '../../testing/bench'
import { createElement } from 'react'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { ParameterRow, ParameterValue } from '../../api/schema'
import { setReadings, setRows } from '../../live/store'
import { type Drawn, Page, press, textOf, type } from '../../testing/render'
import { Editor } from './Detail'
import { discardEdits, type Edit, setEdit, useEdits, writeEdits } from './edits'
import { Grid } from './Grid'

vi.mock('@mantine/core', () => import('../../testing/mantine'))
vi.mock('../../live/live', () => ({ stand: () => {}, send: () => {} }))

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
  new Page([
    createElement(Seen, { key: 'seen' }),
    createElement(Grid, {
      key: 'grid',
      drive: X,
      profile: 'p',
      rows,
      asRaw: false,
      live: false,
      chosen: first.key,
      onChoose: () => {},
    }),
  ])
const body = (page: Page): Drawn => page.one((each) => each.props.role === 'grid')
const button = (page: Page): Drawn =>
  page.one((each) => each.props.className === 'value-button' && textOf(each).includes('50'))
const editor = (page: Page): Drawn => page.one('input')
const key = (name: string, more: object = {}) => ({
  key: name,
  preventDefault: () => {},
  stopPropagation: () => {},
  ...more,
})

beforeEach(() => {
  discardEdits(X)
  setRows(X, rows)
  setReadings(X, [reading('2001:00', 500, { time: null }), reading('2002:00', 300, { time: null })])
  serve(() => 404)
})

describe('a raw edit among values in their unit', () => {
  it('keeps its scale when its cell is opened and left', async () => {
    const page = grid()
    await page.after(() => setEdit(X, first.key, { text: '600', asRaw: true }))
    await page.after(() => press(button(page), 'onClick', { detail: 1 }))
    await page.after(() => press(editor(page), 'onBlur'))
    expect(edits.get(first.key)).toEqual({ text: '600', asRaw: true })
    await page.after(() => press(button(page), 'onClick', { detail: 1 }))
    // The cell is in the unit of its column, whatever the edit was.
    expect(editor(page).props.value).toBe('60')
    await page.after(() => type(editor(page), '70'))
    await page.after(() => press(editor(page), 'onBlur'))
    expect(edits.get(first.key)).toEqual({ text: '70', asRaw: false })
  })

  it('is not shown as if it were in the unit', async () => {
    const page = grid()
    await page.after(() => setEdit(X, first.key, { text: '600', asRaw: true }))
    // 600 raw are 60 rpm; the column beside it says rpm.
    expect(textOf(button(page))).toBe('50 60')
  })

  it('is edited as raw in an editor that was open already', async () => {
    const page = new Page([
      createElement(Seen, { key: 'seen' }),
      createElement(Editor, { key: 'editor', drive: X, row: first }),
    ])
    await page.after(() => setEdit(X, first.key, { text: '600', asRaw: true }))
    expect(page.one('Checkbox').props.checked).toBe(true)
    await page.after(() => type(page.one('TextInput'), '650'))
    expect(edits.get(first.key)).toEqual({ text: '650', asRaw: true })
  })
})

describe('a cell that is opened and left', () => {
  it('edits nothing, although the value has changed meanwhile', async () => {
    const page = grid()
    await page.after(() => press(body(page), 'onKeyDown', { ...key('F2'), target: null }))
    await page.after(() =>
      setReadings(X, [reading(first.key, 510, { time: '2026-11-21T10:00:09Z' })]),
    )
    await page.after(() => press(editor(page), 'onBlur'))
    expect(edits.size).toBe(0)
  })
})

describe('writing', () => {
  const answer = (keys: string[]) =>
    keys.map((each) => ({ key: each, ok: true, reading: reading(each, 600), problem: null }))

  it('keeps what was typed while the value before it was written', async () => {
    const written = later<object>()
    serve(() => written.promise)
    const page = new Page(createElement(Seen))
    setEdit(X, first.key, { text: '60', asRaw: false })
    const done = writeEdits(X, [first.key])
    setEdit(X, first.key, { text: '75', asRaw: false })
    written.give(answer([first.key]))
    await page.after(() => done)
    expect(edits.get(first.key)).toEqual({ text: '75', asRaw: false })
  })

  it('reports by the keyboard what it reports by the button', async () => {
    serve(() => 409)
    const page = grid()
    setEdit(X, first.key, { text: '60', asRaw: false })
    await page.after(() =>
      press(body(page), 'onKeyDown', { ...key('Enter', { ctrlKey: true }), target: null }),
    )
    expect(asked.map((each) => each.method)).toEqual(['PUT'])
    expect(edits.has(first.key)).toBe(true)
    expect(problems.has(first.key)).toBe(true)
  })
})
