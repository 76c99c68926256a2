import { useCallback, useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../../api/client'
import type { AxisHealth, Problem } from '../../../api/schema'
import { useLink } from '../../../live/store'

/** Baseline, comparison and rounds of an axis; `refresh` after a measurement or a signature. */
export function useHealth(drive: string) {
  const { open } = useLink()
  const [health, setHealth] = useState<AxisHealth | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  const refresh = useCallback(async () => {
    try {
      const params = { path: { drive_id: drive } }
      setHealth(await ask(api.GET('/api/v1/drives/{drive_id}/health', { params })))
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
  }, [drive])
  useEffect(() => {
    if (open) void refresh()
  }, [open, refresh])
  return { health, problem, refresh, setHealth }
}
