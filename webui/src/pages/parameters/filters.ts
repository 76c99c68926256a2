import type { ParameterRow, ParameterValue } from '../../api/schema'
import type { ShownRow } from '../../widgets/profile-text/shown-row'

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

interface Wanted {
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

/** Words must all be found, each in name, key, number, group or enum label, in either language. */
export function matches(row: ShownRow, search: string): boolean {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean)
  if (words.length === 0) return true
  const text = [row.key, row.key.replace(':', ''), row.number ?? '']
    .concat(texts(row), row.original ? texts(row.original) : [])
    .join('\n')
    .toLowerCase()
  return words.every(
    (word) => text.includes(word.replace(/^0x/, '').replace(/h$/, '')) || text.includes(word),
  )
}

const texts = (row: ParameterRow) => [row.name, row.group, ...Object.values(row.enum)]

/** The name of a row's group that does not change with the language. */
const groupOf = (row: ShownRow) => (row.original ?? row).group

/** A row that the manual keeps for the maker: shown only to who looks for it. */
const isReserved = (row: ShownRow) => /^reserved\b/i.test((row.original ?? row).name)

export function select(rows: ShownRow[], wanted: Wanted, marks: Marks): ShownRow[] {
  const everything = wanted.filter === 'all' && wanted.search.trim() === ''
  return rows.filter(
    (row) =>
      !(everything && isReserved(row)) &&
      (wanted.group === null || groupOf(row) === wanted.group) &&
      passes(row, wanted.filter, marks) &&
      matches(row, wanted.search),
  )
}

export interface Group {
  name: string
  /** The name in the page's language. */
  label: string
  count: number
}

/** Groups in the profile's own order, with how many rows each has. */
export function groups(rows: ShownRow[]): Group[] {
  const found = new Map<string, Group>()
  for (const row of rows) {
    const name = groupOf(row)
    const group = found.get(name)
    if (group) group.count += 1
    else found.set(name, { name, label: row.group, count: 1 })
  }
  return [...found.values()]
}

/** The communication area 1000h to 1FFFh is rarely wanted: it comes after everything else. */
export function settingsFirst(rows: ShownRow[]): ShownRow[] {
  const communication = (row: ParameterRow) => /^1[0-9A-F]{3}:/.test(row.key)
  return [...rows.filter((row) => !communication(row)), ...rows.filter(communication)]
}
