import type { ParameterRow, ParameterValue } from '../../api/schema'

export const FILTERS = [
  'all',
  'edited',
  'unsaved',
  'changed',
  'differs',
  'favourites',
  'stopped',
  'unread',
] as const
export type Filter = (typeof FILTERS)[number]

export interface Wanted {
  filter: Filter
  group: string | null
  search: string
}

export interface Marks {
  edited: ReadonlySet<string>
  differs: ReadonlySet<string>
  favourites: ReadonlySet<string>
  readings: ReadonlyMap<string, ParameterValue>
}

/** Whether a value in the drive is known and is not the manual's default. */
export function isChanged(row: ParameterRow, reading: ParameterValue | undefined): boolean {
  const raw = reading?.raw ?? null
  return row.default_raw !== null && raw !== null && row.access === 'rw' && raw !== row.default_raw
}

function passes(row: ParameterRow, filter: Filter, marks: Marks): boolean {
  const reading = marks.readings.get(row.key)
  switch (filter) {
    case 'all':
      return true
    case 'edited':
      return marks.edited.has(row.key)
    case 'unsaved':
      return (reading?.unsaved ?? false) || (reading?.pending ?? '') !== ''
    case 'changed':
      return isChanged(row, reading)
    case 'differs':
      return marks.differs.has(row.key)
    case 'favourites':
      return marks.favourites.has(row.key)
    case 'unread':
      return (
        row.reachable &&
        row.access !== 'wo' &&
        (!reading?.time || (reading.error !== '' && !reading.unused))
      )
    case 'stopped':
      return row.settable === 'stopped'
  }
}

/** Words must all be found, each in name, key, number, group or enum label. */
export function matches(row: ParameterRow, search: string): boolean {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean)
  if (words.length === 0) return true
  const text = [row.name, row.key, row.key.replace(':', ''), row.number ?? '', row.group]
    .concat(Object.values(row.enum))
    .join('\n')
    .toLowerCase()
  return words.every(
    (word) => text.includes(word.replace(/^0x/, '').replace(/h$/, '')) || text.includes(word),
  )
}

export function select(rows: ParameterRow[], wanted: Wanted, marks: Marks): ParameterRow[] {
  return rows.filter(
    (row) =>
      (wanted.group === null || row.group === wanted.group) &&
      passes(row, wanted.filter, marks) &&
      matches(row, wanted.search),
  )
}

/** Groups in the profile's own order, with how many rows each has. */
export function groups(rows: ParameterRow[]): [string, number][] {
  const counts = new Map<string, number>()
  for (const row of rows) counts.set(row.group, (counts.get(row.group) ?? 0) + 1)
  return [...counts]
}

/** The communication area 1000h to 1FFFh is rarely wanted: it comes after everything else. */
export function settingsFirst(rows: ParameterRow[]): ParameterRow[] {
  const communication = (row: ParameterRow) => /^1[0-9A-F]{3}:/.test(row.key)
  return [...rows.filter((row) => !communication(row)), ...rows.filter(communication)]
}
