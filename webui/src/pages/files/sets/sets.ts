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

/** Hand a text to the browser as a file. */
export function offerDownload(name: string, parts: BlobPart[], type: string): void {
  const url = URL.createObjectURL(new Blob(parts, { type }))
  const anchor = document.createElement('a')
  anchor.href = url
  anchor.download = name
  anchor.click()
  // The browser has taken the data over by the time the next task runs.
  setTimeout(() => URL.revokeObjectURL(url), 1000)
}

/** Where a set is to be had as a list for other tools. */
export function listUrl(file: string, format: 'csv' | 'dcf'): string {
  return `${API_ROOT}/api/v1/sets/${encodeURIComponent(file)}/list?format=${format}`
}
