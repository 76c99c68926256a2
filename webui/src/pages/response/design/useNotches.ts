import { useRef, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { NotchPreviewInfo, NotchSlotInfo } from '../../../api/schema'
import { useAnswer } from '../../../widgets/requests/useAnswer'
import { useFetched } from '../../../widgets/drive/useFunctions'
import type { NotchShape } from '../results'

const SETTLE_MS = 250
const MOST_LINES = 5000

/** The notch that acts in a slot, in digits that a person would type; null where none does. */
export function inForce(slot: NotchSlotInfo): NotchShape | null {
  return slot.enabled && slot.notch ? legible(slot.notch) : null
}

export const legible = (notch: NotchShape): NotchShape => ({
  center_hz: Number(notch.center_hz.toPrecision(4)),
  width_hz: Number(notch.width_hz.toPrecision(4)),
  depth_db: Number(notch.depth_db.toFixed(1)),
})

export const same = (a: NotchShape | null, b: NotchShape | null) =>
  JSON.stringify(a) === JSON.stringify(b)

/**
 * What is wanted once the slots were read again: slots that nobody edited are as they are in the
 * drive now, the others stay as they were typed.
 */
export function merged(
  wanted: readonly (NotchShape | null)[],
  before: readonly NotchSlotInfo[],
  now: readonly NotchSlotInfo[],
): (NotchShape | null)[] {
  return now.map((slot, i) => {
    const [old, typed] = [before[i], wanted[i]]
    const untouched = old === undefined || typed === undefined || same(typed, inForce(old))
    return untouched ? inForce(slot) : typed
  })
}

/** Notches of a drive as they are, as they are wanted, and what the drive would make of that. */
export function useNotches(drive: string, frequency: number[]) {
  const [wanted, setWanted] = useState<(NotchShape | null)[]>([])
  const before = useRef<NotchSlotInfo[]>([])
  const path = { params: { path: { drive_id: drive } } }
  const slots = useFetched<NotchSlotInfo[]>(async () => {
    const found = await ask(api.GET('/api/v1/drives/{drive_id}/notches', path))
    // Also after every loss of the connection, which must not drop what was typed.
    const known = before.current
    setWanted((old) => merged(old, known, found))
    before.current = found
    return found
  }, [drive])
  const { problem } = slots
  /** Read the slots again, and drop what was typed. */
  const read = () => {
    before.current = []
    return slots.read()
  }
  const now = problem ? null : slots.data
  const asked = JSON.stringify(wanted)
  const { found: preview, problem: refused } = useAnswer<NotchPreviewInfo>(
    now &&
      (() =>
        ask(
          api.POST('/api/v1/drives/{drive_id}/notches/preview', {
            ...path,
            body: { notches: wanted, frequency_hz: frequency.slice(0, MOST_LINES) },
          }),
        )),
    SETTLE_MS,
    [asked, drive, now, frequency],
  )
  const set = (slot: number, notch: NotchShape | null) =>
    setWanted((old) => old.map((each, i) => (i === slot ? notch : each)))
  /** A notch in the first free slot; false where all are taken. */
  const add = (notch: NotchShape): boolean => {
    const free = wanted.findIndex((each) => each === null)
    if (free < 0) return false
    set(free, notch)
    return true
  }
  const edited = now !== null && asked !== JSON.stringify(now.map(inForce))
  /** Levels without a printed meaning cannot be edited as a shape. */
  const shaped = now !== null && now.some((slot) => slot.note_message?.code !== 'notch.no-meaning')
  return { now, wanted, set, add, read, problem, preview, refused, edited, shaped }
}
export type Notches = ReturnType<typeof useNotches>
