import type { AuditEvent } from '../../api/schema'
import { dayStart } from '../../widgets/requests/days'

export type AuditKind = AuditEvent['kind']

export interface AuditFilters {
  kind: AuditKind | ''
  person: string
  axis: string
  words: string
  since: string
  until: string
}
export const ALL: AuditFilters = {
  kind: '',
  person: '',
  axis: '',
  words: '',
  since: '',
  until: '',
}

/** The query of these filters; days are those of the person's own calendar. */
export function auditQuery(filters: AuditFilters) {
  return {
    kind: filters.kind ? [filters.kind] : null,
    person: filters.person,
    axis: filters.axis,
    words: filters.words,
    since: filters.since ? dayStart(filters.since) : null,
    until: filters.until ? dayStart(filters.until, 1) : null,
  }
}
