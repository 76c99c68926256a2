import { api, ask, problemOf } from '../../api/client'
import type { Problem, WriteResult } from '../../api/schema'
import { contents, publish, setReadings, useStore, whenGone } from '../../live/store'
import { toValue } from '../../widgets/numbers/format'
import { parseTyped } from '../../widgets/numbers/parse'
import type { ParameterInfo } from '../../widgets/parameters/types'

/** A typed value that is not in the drive. It survives leaving the page, not closing it. */
export interface Edit {
  text: string
  /** The text is a raw value rather than one in the parameter's unit. */
  asRaw: boolean
}

interface DriveEdits {
  edits: ReadonlyMap<string, Edit>
  problems: ReadonlyMap<string, Problem>
  differs: ReadonlyMap<string, string>
  writing: { done: number; total: number } | null
  /** Typed values that were dropped, because another drive has the id now, or none. */
  dropped: number
}

const EMPTY: DriveEdits = {
  edits: new Map(),
  problems: new Map(),
  differs: new Map(),
  writing: null,
  dropped: 0,
}
const CHUNK = 16
const byDrive = new Map<string, DriveEdits>()

const get = (drive: string) => byDrive.get(drive) ?? EMPTY

function change(drive: string, part: Partial<DriveEdits>): void {
  byDrive.set(drive, { ...get(drive), ...part })
  publish(`edits ${drive}`)
}

/** Counts the drives that had an id: what was typed for one is not written to another. */
const turns = new Map<string, number>()
const turnOf = (drive: string) => turns.get(drive) ?? 0

whenGone((drive) => {
  turns.set(drive, turnOf(drive) + 1)
  const { edits, dropped } = get(drive)
  byDrive.set(drive, { ...EMPTY, dropped: dropped + edits.size })
  publish(`edits ${drive}`)
})

export const noteDropped = (drive: string) => change(drive, { dropped: 0 })

export const useEdits = (drive: string) => useStore(`edits ${drive}`, () => get(drive))

export function setEdit(drive: string, key: string, edit: Edit | null): void {
  const edits = new Map(get(drive).edits)
  const problems = new Map(get(drive).problems)
  problems.delete(key)
  if (edit === null) edits.delete(key)
  else edits.set(key, edit)
  change(drive, { edits, problems })
}

/** The text of an edit, raw or in the unit, whichever it was typed as. */
export function textAs(row: ParameterInfo, edit: Edit, asRaw: boolean): string {
  const typed = parseTyped(row, edit.text, edit.asRaw)
  if (edit.asRaw === asRaw || Object.keys(row.enum).length > 0 || !typed.ok) return edit.text
  if (typed.value !== undefined) return String((typed.value - row.offset) / row.scale)
  return String(asRaw ? typed.raw : toValue(row, typed.raw ?? ''))
}

/** Mark an edited value with the reason why it was not written. */
export function setProblem(drive: string, key: string, problem: Problem): void {
  change(drive, { problems: new Map(get(drive).problems).set(key, problem) })
}

export function discardEdits(drive: string): void {
  change(drive, { edits: new Map(), problems: new Map() })
}

/** Rows that differ from what was compared with last; the text says what that was. */
export function setDiffers(drive: string, differs: ReadonlyMap<string, string>): void {
  change(drive, { differs })
}

/**
 * Write edited values, each read back. A written one is no longer edited, unless it was edited
 * again meanwhile; a refused one stays edited with the reason. Returns what failed as a whole, such
 * as a lost connection.
 */
export async function writeEdits(drive: string, keys: string[]): Promise<Problem | null> {
  const rows = new Map(contents.rows.get(drive)?.map((row) => [row.key, row]))
  const wanted = keys.flatMap((key) => {
    const edit = get(drive).edits.get(key)
    const row = rows.get(key)
    return edit && row ? [{ key, edit, row }] : []
  })
  let done = 0
  const turn = turnOf(drive)
  try {
    for (let i = 0; i < wanted.length && turn === turnOf(drive); i += CHUNK) {
      change(drive, { writing: { done, total: wanted.length } })
      const chunk = wanted.slice(i, i + CHUNK)
      const values: Record<string, { raw: string | number | null; value: number | null }> = {}
      for (const { key, edit, row } of chunk) {
        const body = toBody(row, edit)
        if (body) values[key] = body
      }
      const results = await ask(
        api.PUT('/api/v1/drives/{drive_id}/parameters', {
          params: { path: { drive_id: drive } },
          body: { values },
        }),
      )
      // Read back from a drive that has this id no more.
      if (turn !== turnOf(drive)) break
      settle(drive, results, new Map(chunk.map(({ key, edit }) => [key, edit])))
      done += chunk.length
    }
    return null
  } catch (error) {
    return problemOf(error)
  } finally {
    change(drive, { writing: null })
  }
}

function toBody(
  row: ParameterInfo,
  edit: Edit,
): { raw: string | number | null; value: number | null } | null {
  const typed = parseTyped(row, edit.text, edit.asRaw)
  return typed.ok ? { raw: typed.raw ?? null, value: typed.value ?? null } : null
}

function settle(drive: string, results: WriteResult[], sent: ReadonlyMap<string, Edit>): void {
  setReadings(
    drive,
    results.map((result) => result.reading),
  )
  const edits = new Map(get(drive).edits)
  const problems = new Map(get(drive).problems)
  const differs = new Map(get(drive).differs)
  for (const result of results) {
    if (result.ok) differs.delete(result.key) // compared with the old value
    if (edits.get(result.key) !== sent.get(result.key)) continue
    if (result.ok) {
      edits.delete(result.key)
      problems.delete(result.key)
    } else if (result.problem) problems.set(result.key, result.problem)
  }
  change(drive, { edits, problems, differs })
}

// --- favourites: kept in this browser, per drive family -------------------------------------

const stored = (profile: string) => `servodeck.favourites.${profile}`
const favourites = new Map<string, ReadonlySet<string>>()

function loadFavourites(profile: string): ReadonlySet<string> {
  let set = favourites.get(profile)
  if (!set) {
    let keys: unknown = []
    try {
      keys = JSON.parse(localStorage.getItem(stored(profile)) ?? '[]')
    } catch {
      // A damaged entry is as good as none.
    }
    set = new Set(Array.isArray(keys) ? keys.filter((key) => typeof key === 'string') : [])
    favourites.set(profile, set)
  }
  return set
}

export const useFavourites = (profile: string) =>
  useStore(`favourites ${profile}`, () => loadFavourites(profile))

export function toggleFavourite(profile: string, key: string): void {
  const set = new Set(loadFavourites(profile))
  if (!set.delete(key)) set.add(key)
  favourites.set(profile, set)
  localStorage.setItem(stored(profile), JSON.stringify([...set]))
  publish(`favourites ${profile}`)
}
