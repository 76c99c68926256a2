// @vitest-environment happy-dom
import { asked, sent, serve, settled, shown, type } from '../../../testing/page'
import { screen, waitFor } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it } from 'vitest'
import type { NotchSlotInfo } from '../../../api/schema'
import { setLink } from '../../../live/store'
import { NotchEditor } from './NotchEditor'
import { merged, type Notches, useNotches } from './useNotches'

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
  return <NotchEditor drive="x" notches={notches} />
}
const connected = (open: boolean) => setLink({ open, attempt: 0, roundTripMs: null }, 0)
const opened = async () => {
  await shown(<Editor />)
  // The editor waits before it asks what the drive would make of the notches.
  await waitFor(() => expect(sent('/preview')).toBeDefined())
  await settled()
}
const field = (name: string) => screen.getByRole<HTMLInputElement>('textbox', { name })

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
    await opened()
    await settled(() => notches.set(0, shape(520)))
    await settled(() => connected(false))
    await settled(() => connected(true))
    expect(notches.wanted[0]).toEqual(shape(520))
    expect(notches.edited).toBe(true)
    await userEvent.click(screen.getByRole('button', { name: 'Read them again' }))
    await settled()
    expect(notches.wanted[0]).toEqual(shape(400))
  })

  it('are not written while a field has no number', async () => {
    await opened()
    const write = () =>
      screen.getByRole<HTMLButtonElement>('button', { name: 'Write the notches' }).disabled
    await type(field('Width (−3 dB)'), '120')
    await waitFor(() => expect(write()).toBe(false))
    await type(field('Centre'), '5OO')
    expect(field('Centre').value).toBe('5OO')
    expect(write()).toBe(true)
    // Moved on the plot, the notch has a number again, and the field shows it.
    await settled(() => notches.set(0, { ...shape(480), width_hz: 120 }))
    expect(field('Centre').value).toBe('480')
    expect(write()).toBe(false)
    expect(asked.some((each) => each.method === 'PUT')).toBe(false)
  })
})
