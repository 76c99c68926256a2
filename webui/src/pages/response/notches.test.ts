import { asked, serve } from '../../testing/bench'
import { createElement } from 'react'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { NotchSlotInfo } from '../../api/schema'
import { setLink } from '../../live/store'
import { Page, press, type } from '../../testing/render'
import { NotchEditor } from './NotchEditor'
import { merged, type Notches, useNotches } from './useNotches'

vi.mock('@mantine/core', () => import('../../testing/mantine'))

const slot = (number: number, center_hz: number | null): NotchSlotInfo => ({
  slot: number,
  enabled: center_hz !== null,
  notch: center_hz === null ? null : { center_hz, width_hz: 100, depth_db: -20 },
  realised: null,
  raw: {},
  note: '',
  note_message: null,
})
const shape = (center_hz: number) => ({ center_hz, width_hz: 100, depth_db: -20 })
const LINES = [10, 20]
let slots: NotchSlotInfo[] = []
let notches: Notches

function Editor() {
  notches = useNotches('x', LINES)
  return createElement(NotchEditor, { drive: 'x', notches })
}
const connected = (open: boolean) => setLink({ open, attempt: 0, roundTripMs: null }, 0)
const settled = () => new Promise((resolve) => setTimeout(resolve, 300))
const opened = async () => {
  const page = new Page(createElement(Editor))
  await page.after()
  await settled()
  return page.after()
}

beforeEach(() => {
  connected(true)
  slots = [slot(0, 400), slot(1, null)]
  serve(({ method, path }) =>
    path.endsWith('/preview')
      ? { slots, magnitude_db: [], phase_deg: [] }
      : method === 'GET'
        ? slots
        : { before: { a: 1 }, after: { a: 2 } },
  )
})

describe('notches that were edited', () => {
  it('are kept where the slots are read again, and others are as the drive has them', () => {
    const before = [slot(0, 400), slot(1, 700), slot(2, null)]
    const now = [slot(0, 450), slot(1, 750), slot(2, null)]
    expect(merged([shape(400), shape(600), shape(90)], before, now)).toEqual([
      shape(450),
      shape(600),
      shape(90),
    ])
    // Switched off by a person, and by a drive that has fewer of them.
    expect(merged([null, null, null], before, now.slice(0, 2))).toEqual([null, null])
    expect(merged([shape(1)], [], now)).toEqual([shape(450), shape(750), null])
  })

  it('outlive a lost connection', async () => {
    const page = await opened()
    await page.after(() => notches.set(0, shape(520)))
    await page.after(() => connected(false))
    await page.after(() => connected(true))
    expect(notches.wanted[0]).toEqual(shape(520))
    expect(notches.edited).toBe(true)
    await page.after(() => press(page.named('Button', 'Read them again')))
    expect(notches.wanted[0]).toEqual(shape(400))
    page.end()
  })

  it('are not written while a field has no number', async () => {
    const page = await opened()
    const write = () => page.named('Button', 'Write the notches').props.disabled
    await page.after(() => type(page.named('TextInput', 'Width (−3 dB)'), '120'))
    await settled()
    await page.after()
    expect(write()).toBe(false)
    await page.after(() => type(page.named('TextInput', 'Centre'), '5OO'))
    expect(page.named('TextInput', 'Centre').props.value).toBe('5OO')
    expect(write()).toBe(true)
    // Moved on the plot, the notch has a number again, and the field shows it.
    await page.after(() => notches.set(0, { ...shape(480), width_hz: 120 }))
    expect(page.named('TextInput', 'Centre').props.value).toBe('480')
    expect(write()).toBe(false)
    expect(asked.some((each) => each.method === 'PUT')).toBe(false)
    page.end()
  })
})
