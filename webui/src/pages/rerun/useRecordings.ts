import { useCallback, useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { Problem, RecordingList } from '../../api/schema'
import { useLink } from '../../live/store'

const PERIOD_MS = 1000

/** The list of recordings, asked for again and again, since running ones grow. */
export function useRecordings(search: string) {
  const { open } = useLink()
  const [list, setList] = useState<RecordingList | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  const refresh = useCallback(async () => {
    try {
      setList(await ask(api.GET('/api/v1/recordings', { params: { query: { search } } })))
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
  }, [search])
  useEffect(() => {
    if (!open) return
    void refresh()
    const timer = setInterval(() => void refresh(), PERIOD_MS)
    return () => clearInterval(timer)
  }, [open, refresh])
  return { list, problem, refresh }
}
