import { useCallback, useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { MeasurementInfo, Problem } from '../../api/schema'
import { useLink } from '../../live/store'
import { asSweep, type Sweep } from './results'

/** Stored frequency responses, newest first. */
export function useMeasurements() {
  const { open } = useLink()
  const [list, setList] = useState<MeasurementInfo[]>([])
  const [problem, setProblem] = useState<Problem | null>(null)
  const refresh = useCallback(async () => {
    try {
      const all = await ask(api.GET('/api/v1/measurements'))
      setList(all.filter((each) => each.kind.startsWith('sweep-') || each.problem !== ''))
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
  }, [])
  useEffect(() => {
    if (open) void refresh()
  }, [open, refresh])
  return { list, problem, refresh }
}

/** One stored response, evaluated by the server; null while it is not there. */
export function useSweep(file: string | null) {
  const [found, setFound] = useState<{ file: string; sweep: Sweep | null } | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  useEffect(() => {
    setProblem(null)
    if (file === null) return
    let current = true
    ask(api.GET('/api/v1/measurements/{name}', { params: { path: { name: file } } })).then(
      (content) => current && setFound({ file, sweep: asSweep(content.result) }),
      (error: unknown) => current && setProblem(problemOf(error)),
    )
    return () => {
      current = false
    }
  }, [file])
  return { sweep: file !== null && found?.file === file ? found.sweep : null, problem }
}
