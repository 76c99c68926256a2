import { useSyncExternalStore } from 'react'
import type { Problem } from '../../../api/schema'
import { type DriveIdentity, identityNow, publish, sameDrive, subscribe } from '../../../live/store'

/** What a write answers: raw values that undo it, and those that it left. */
export interface Written {
  before: Record<string, number>
  after?: Record<string, number> | null
}

/** A change that was written. */
export interface Change extends Written {
  what: 'notches' | 'gains' | 'candidate' | 'undo'
  time: string
  /** The drive that was changed; another one may have its id by now. Earlier versions kept none. */
  of?: DriveIdentity | null
}

const KEPT = 8
const known = new Map<string, Change[]>()
const listeners = new Set<() => void>()
function listen(listener: () => void): () => void {
  listeners.add(listener)
  return () => listeners.delete(listener)
}
const NONE: Change[] = []
/** Changes that were dropped, because they were of another drive with the same id. */
const foreign = new Map<string, number>()
const place = (drive: string) => `servodeck.${drive}.tune.undo`

function read(drive: string): Change[] {
  let list = known.get(drive)
  if (!list) {
    list = stored(drive)
    known.set(drive, list)
  }
  return list
}

function stored(drive: string): Change[] {
  let all: Change[]
  try {
    const found: unknown = JSON.parse(localStorage.getItem(place(drive)) ?? '[]')
    all = Array.isArray(found) ? (found as Change[]).filter((each) => each?.before) : NONE
  } catch {
    return NONE
  }
  const now = identityNow(drive)
  const own = all.filter(({ of }) => !now || !of || sameDrive(of, now))
  if (own.length < all.length) {
    foreign.set(drive, (foreign.get(drive) ?? 0) + all.length - own.length)
    localStorage.setItem(place(drive), JSON.stringify(own))
  }
  return own
}

/** Which drives there are has changed: what was kept may be of another one. */
subscribe('drives', () => {
  const isOther = ([drive, list]: [string, Change[]]) => {
    const now = identityNow(drive)
    return now !== null && list.some(({ of }) => of && !sameDrive(of, now))
  }
  if (![...known].some(isOther)) return
  known.clear()
  for (const listener of listeners) listener()
})

/** How many changes of another drive were dropped here, until a person has read it. */
export const useForeign = (drive: string): number =>
  useSyncExternalStore(listen, () => {
    read(drive)
    return foreign.get(drive) ?? 0
  })

export function noteForeign(drive: string): void {
  foreign.delete(drive)
  for (const listener of listeners) listener()
}

function store(drive: string, list: Change[]): void {
  known.set(drive, list)
  localStorage.setItem(place(drive), JSON.stringify(list))
  for (const listener of listeners) listener()
}

/** Keep what a write returned; nothing is kept of a write that changed nothing. */
export function remember(drive: string, what: Change['what'], done: Written): void {
  if (Object.keys(done.before).length === 0) return
  const { before, after = null } = done
  const time = new Date().toISOString()
  const change = { what, time, before, after, of: identityNow(drive) }
  // What another tab has written meanwhile is among the stored ones.
  store(drive, [...stored(drive), change].slice(-KEPT))
}

/** Whether a change was not undone because a value of it was changed again since. */
export const changedSince = (problem: Problem | null, before: Record<string, number>): boolean =>
  problem?.type === 'urn:servodeck:not-allowed' &&
  problem.parameter != null &&
  problem.parameter in before &&
  problem.limit != null

let undone = 0

/** How many changes this page has undone. */
export const undoneCount = (): number => undone

/** Keep that a change was undone. */
export function noteUndone(): void {
  undone += 1
  publish('undone')
}

/** Take a change off the list, once it has been undone. */
export const forget = (drive: string, undone: Change) =>
  store(
    drive,
    stored(drive).filter((each) => each.time !== undone.time || each.what !== undone.what),
  )

// Another tab of this browser has written or undone something.
globalThis.window?.addEventListener('storage', () => {
  known.clear()
  for (const listener of listeners) listener()
})

/** Changes to an axis that can be undone, newest last. */
export const useChanges = (drive: string): Change[] =>
  useSyncExternalStore(listen, () => read(drive))
