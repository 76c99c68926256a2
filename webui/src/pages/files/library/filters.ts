import type { LibraryEntry } from '../../../api/schema'
import { dayStart } from '../../../widgets/requests/days'

export type LibraryKind = LibraryEntry['kind']
export const KINDS: readonly LibraryKind[] = ['set', 'recording', 'measurement', 'report']
/** The tag that the server puts on sets made before something is loaded. */
export const UNDO = 'undo'

export interface Filters {
  words: string
  kind: LibraryKind | ''
  tag: string
  since: string
  until: string
  undo: boolean
  deleted: boolean
}
export const NO_FILTERS: Filters = {
  words: '',
  kind: '',
  tag: '',
  since: '',
  until: '',
  undo: false,
  deleted: false,
}

/** The query of these filters; days are those of the person's own calendar. */
export function queryOf(filters: Filters, limit: number) {
  return {
    words: filters.words,
    kind: filters.kind ? [filters.kind] : null,
    tag: filters.tag,
    without: filters.undo || filters.tag === UNDO ? '' : UNDO,
    since: filters.since ? dayStart(filters.since) : null,
    until: filters.until ? dayStart(filters.until, 1) : null,
    deleted: filters.deleted,
    limit,
  }
}
