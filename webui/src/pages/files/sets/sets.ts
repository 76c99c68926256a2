import { useCallback, useEffect, useState } from 'react'
import { API_ROOT, api, ask, problemOf } from '../../../api/client'
import type { Problem, StoredSet } from '../../../api/schema'
import { useLink } from '../../../live/store'

/** Stored parameter sets, newest first. */
export function useSets() {
  const { open } = useLink()
  const [sets, setSets] = useState<StoredSet[]>([])
  const [problem, setProblem] = useState<Problem | null>(null)
  const refresh = useCallback(async () => {
    try {
      setSets(await ask(api.GET('/api/v1/sets')))
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
  }, [])
  useEffect(() => {
    if (open) void refresh()
  }, [open, refresh])
  return { sets, refresh, problem }
}

/** Where a set is to be had as a list for other tools. */
export function listUrl(file: string, format: 'csv' | 'dcf'): string {
  return `${API_ROOT}/api/v1/sets/${encodeURIComponent(file)}/list?format=${format}`
}
