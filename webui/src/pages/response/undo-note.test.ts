import { asked, later, refusal, serve } from '../../testing/bench'
import { createElement } from 'react'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { ParameterRow, ParameterValue } from '../../api/schema'
import { setReadings, setRows } from '../../live/store'
import { Page, press } from '../../testing/render'
import { ParameterFields } from '../../widgets/ParameterFields'
import { setEdit } from '../parameters/edits'
import { remember, useChanges } from './undo'
import { UndoNote } from './UndoNote'

vi.mock('@mantine/core', () => import('../../testing/mantine'))
vi.mock('../../live/live', () => ({ stand: () => {}, send: () => {} }))

let changes: ReturnType<typeof useChanges> = []
let drive = ''
function Note() {
  changes = useChanges(drive)
  return createElement(UndoNote, { drive, onUndone: () => {} })
}
const button = (page: Page) => page.one('Button')
const sent = () => asked.at(-1)?.body as { before: object; after: object | null }

let number = 0
beforeEach(() => {
  drive = `x${(number += 1)}`
  serve(() => ({ before: {}, after: {} }))
})

describe('an undo', () => {
  it('takes the change off the list that it undid, not one written meanwhile', async () => {
    remember(drive, 'gains', { before: { a: 1 }, after: { a: 2 } })
    const page = new Page(createElement(Note))
    const answer = later<object>()
    serve(() => answer.promise)
    await page.after(() => press(button(page)))
    await new Promise((resolve) => setTimeout(resolve, 2))
    remember(drive, 'notches', { before: { b: 1 }, after: { b: 2 } })
    await page.after(() => answer.give({ before: {}, after: {} }))
    expect(changes.map((each) => each.what)).toEqual(['notches'])
  })

  it('overwrites what somebody wrote since only where that change was refused for it', async () => {
    remember(drive, 'gains', { before: { a: 1 }, after: { a: 2 } })
    const page = new Page(createElement(Note))
    serve(() => refusal(409, { parameter: 'a', limit: '2' }))
    await page.after(() => press(button(page)))
    await new Promise((resolve) => setTimeout(resolve, 2))
    expect(button(page).children).toEqual(['Undo anyway'])
    await page.after(() => remember(drive, 'gains', { before: { a: 7 }, after: { a: 8 } }))
    serve(() => ({ before: {}, after: {} }))
    await page.after(() => press(button(page)))
    expect(sent()).toEqual({ before: { a: 7 }, after: { a: 8 } })
  })

  it('of another tab is known, and changes of both are kept', async () => {
    remember(drive, 'gains', { before: { a: 1 } })
    const place = `servodeck.${drive}.tune.undo`
    const other = { what: 'notches', time: '2026-11-21T10:00:00Z', before: { b: 1 }, after: null }
    const list = JSON.parse(localStorage.getItem(place) ?? '[]') as object[]
    localStorage.setItem(place, JSON.stringify([...list, other]))
    remember(drive, 'candidate', { before: { c: 1 } })
    const page = new Page(createElement(Note))
    await page.after()
    expect(changes.map((each) => each.what)).toEqual(['gains', 'notches', 'candidate'])
  })
})

describe('parameters in a form', () => {
  const reading = (raw: number, time: string): ParameterValue => ({
    key: 'k',
    raw,
    value: raw,
    time,
    error: '',
    pending: '',
    unsaved: false,
    unused: false,
  })

  it('report what they left, so that an undo does not overwrite what was written since', async () => {
    const row = {
      key: 'k', name: 'Gain', number: null, group: '', type: 'INT16', access: 'rw', unit: '',
      scale: 1, offset: 0, min_raw: null, max_raw: null, default_raw: null, enum: {}, bits: {},
      reachable: true, motion: 'none', settable: 'any', reading: reading(5, '2026-11-21T10:00:00Z'),
    } // prettier-ignore
    setRows(drive, [row as unknown as ParameterRow])
    setReadings(drive, [row.reading])
    const written = vi.fn()
    serve(({ method }) =>
      method === 'PUT'
        ? [{ key: 'k', ok: true, reading: reading(9, '2026-11-21T10:00:05Z'), problem: null }]
        : 404,
    )
    const page = new Page(
      createElement(ParameterFields, { drive, keys: ['k'], onWritten: written }),
    )
    await page.after(() => setEdit(drive, 'k', { text: '9', asRaw: true }))
    await page.after(() => press(page.named('Button', 'Write (1)')))
    expect(written).toHaveBeenCalledWith({ k: 5 }, { k: 9 })
  })
})
