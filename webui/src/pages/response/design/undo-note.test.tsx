// @vitest-environment happy-dom
import { asked, later, refusal, serve, settled, shown, type } from '../../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { DriveSummary, ParameterRow, ParameterValue } from '../../../api/schema'
import { setDrives, setReadings, setRows } from '../../../live/store'
import { ParameterFields } from '../../../widgets/parameters/ParameterFields'
import { remember, useChanges } from './undo'
import { UndoNote } from './UndoNote'

let changes: ReturnType<typeof useChanges> = []
let drive = ''
function Note() {
  changes = useChanges(drive)
  return <UndoNote drive={drive} onUndone={() => {}} />
}
const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))
/** Changes are told apart by their time. */
async function nextMillisecond(): Promise<void> {
  const begun = Date.now()
  while (Date.now() === begun) await settled()
}
const sent = () => asked.at(-1)?.body as { before: object; after: object | null }

let number = 0
beforeEach(() => {
  drive = `x${(number += 1)}`
  serve(() => ({ before: {}, after: {} }))
})

describe('an undo', () => {
  it('takes the change off the list that it undid, not one written meanwhile', async () => {
    remember(drive, 'gains', { before: { a: 1 }, after: { a: 2 } })
    await shown(<Note />)
    const answer = later<object>()
    serve(() => answer.promise)
    await press('Undo')
    await nextMillisecond()
    await settled(() => remember(drive, 'notches', { before: { b: 1 }, after: { b: 2 } }))
    await settled(() => answer.give({ before: {}, after: {} }))
    expect(changes.map((each) => each.what)).toEqual(['notches'])
  })

  it('overwrites what somebody wrote since only where that change was refused for it', async () => {
    remember(drive, 'gains', { before: { a: 1 }, after: { a: 2 } })
    await shown(<Note />)
    serve(() => refusal(409, { parameter: 'a', limit: '2' }))
    await press('Undo')
    await nextMillisecond()
    expect(screen.queryByRole('button', { name: 'Undo anyway' })).not.toBeNull()
    await settled(() => remember(drive, 'gains', { before: { a: 7 }, after: { a: 8 } }))
    serve(() => ({ before: {}, after: {} }))
    await press('Undo')
    await settled()
    expect(sent()).toEqual({ before: { a: 7 }, after: { a: 8 } })
  })

  it('of another tab is known, and changes of both are kept', async () => {
    remember(drive, 'gains', { before: { a: 1 } })
    const place = `servodeck.${drive}.tune.undo`
    const other = { what: 'notches', time: '2026-11-21T10:00:00Z', before: { b: 1 }, after: null }
    const list = JSON.parse(localStorage.getItem(place) ?? '[]') as object[]
    localStorage.setItem(place, JSON.stringify([...list, other]))
    remember(drive, 'candidate', { before: { c: 1 } })
    await shown(<Note />)
    expect(changes.map((each) => each.what)).toEqual(['gains', 'notches', 'candidate'])
  })

  it('lists what it writes by name, in the unit of the parameter', async () => {
    const row = {
      key: '2005:03', name: 'Speed loop bandwidth', number: null, group: '', type: 'UINT16',
      access: 'rw', unit: 'Hz', scale: 0.1, offset: 0, enum: {}, bits: {},
      reading: { key: '2005:03', raw: 200, value: 20, time: null },
    } // prettier-ignore
    setRows(drive, [row as unknown as ParameterRow])
    remember(drive, 'gains', { before: { '2005:03': 1500, '2005:09': 7 } })
    await shown(<Note />)
    const of = (name: string) =>
      [...document.querySelectorAll(name)].map((each) => each.textContent?.trim())
    expect(of('dt')).toEqual(['2005:03 Speed loop bandwidth', '2005:09'])
    expect(of('dd')).toEqual(['150 Hz', '7'])
  })
})

describe('changes of another drive that had the id before', () => {
  const there = (serial: number) =>
    setDrives([{ id: drive, profile: 'p', serial, ports: [] } as unknown as DriveSummary])

  it('are dropped with a notice, also where they were kept by an earlier visit', async () => {
    there(1)
    remember(drive, 'gains', { before: { a: 1 } })
    remember(drive, 'notches', { before: { b: 1 } })
    await shown(<Note />)
    expect(changes).toHaveLength(2)
    // The same drive, which was away for a while.
    await settled(() => setDrives([]))
    await settled(() => there(1))
    expect(changes).toHaveLength(2)
    await settled(() => there(2))
    expect(changes).toEqual([])
    expect(screen.queryByRole('button', { name: 'Undo' })).toBeNull()
    expect(screen.getByText(/^2 changes of another drive/)).not.toBeNull()
    expect(localStorage.getItem(`servodeck.${drive}.tune.undo`)).toBe('[]')
    await press('Close')
    expect(screen.queryByText(/changes of another drive/)).toBeNull()
    await settled(() => remember(drive, 'gains', { before: { c: 1 } }))
    expect(changes.map((each) => each.before)).toEqual([{ c: 1 }])
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
    await shown(<ParameterFields drive={drive} keys={['k']} onWritten={written} />)
    await type(screen.getByRole('textbox', { name: 'Gain' }), '9')
    await press('Write (1)')
    await settled()
    expect(written).toHaveBeenCalledWith({ k: 5 }, { k: 9 })
  })
})
