import { useCallback, useRef, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { AuditEvent, AuditNames, AuditStatus, Problem } from '../../api/schema'
import { useLink } from '../../live/store'
import { useSearch } from '../../widgets/requests/useSearch'
import { type AuditFilters, auditQuery } from './filters'

/** Entries that fit, newest first; `older` adds the ones before them. */
export function useAudit(filters: AuditFilters) {
  const { open } = useLink()
  const [events, setEvents] = useState<AuditEvent[] | null>(null)
  const [next, setNext] = useState<number | null>(null)
  const [names, setNames] = useState<AuditNames | null>(null)
  const [status, setStatus] = useState<AuditStatus | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  const key = JSON.stringify(filters)
  const asked = useRef(key)
  asked.current = key
  const turn = useRef(0)
  const load = useCallback(
    async (before: number | null) => {
      const own = (turn.current += 1)
      const query = { ...auditQuery(JSON.parse(key) as AuditFilters), before }
      try {
        setStatus(await ask(api.GET('/api/v1/audit/status')))
        const page = await ask(api.GET('/api/v1/audit', { params: { query } }))
        // Another filter was chosen meanwhile, or the same entries were asked for again.
        if (asked.current !== key || turn.current !== own) return
        setEvents((known) => (before === null ? page.events : [...(known ?? []), ...page.events]))
        setNext(page.next ?? null)
        if (before === null) setNames(await ask(api.GET('/api/v1/audit/names')))
        setProblem(null)
      } catch (error) {
        setProblem(problemOf(error))
      }
    },
    [key],
  )
  const newest = useCallback(() => load(null), [load])
  useSearch(newest, open)
  return {
    events,
    names,
    status,
    problem,
    refresh: () => void load(null),
    older: next === null ? null : () => void load(next),
  }
}
