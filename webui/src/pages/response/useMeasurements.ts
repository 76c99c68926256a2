import { useCallback, useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { DriveSummary, MeasurementContent, MeasurementInfo, Problem } from '../../api/schema'
import { useLink } from '../../live/store'
import { asSweep } from './results'

/** Kind of what came from another program; compares with measurements of the mechanics. */
const IMPORTED = 'imported-response'
export const comparable = (one: string | undefined, other: string): boolean =>
  one === other ||
  (one === IMPORTED && other === 'sweep-mechanics') ||
  (one === 'sweep-mechanics' && other === IMPORTED)

type Measured = Pick<MeasurementInfo, 'drive' | 'profile' | 'serial'>

/** Whether it was measured on this axis, as `belongs` of backend/report/gather.py has it. */
export const ofAxis = (
  { drive, profile, serial }: Measured,
  axis: Pick<DriveSummary, 'name' | 'profile' | 'serial'>,
): boolean =>
  profile === axis.profile &&
  (serial !== null && axis.serial !== null ? serial === axis.serial : drive === axis.name)

/** Whether two were measured on one axis. */
export const ofOneAxis = (one: Measured, other: Measured): boolean =>
  ofAxis(one, { ...other, name: other.drive })

/**
 * Stored measurements (of a kind), newest first; those that cannot be used are among them.
 * `asked`: the list, or the problem, is an answer.
 */
export function useMeasurements(kind: 'sweep-' | '' = 'sweep-') {
  const { open } = useLink()
  const [list, setList] = useState<MeasurementInfo[]>([])
  const [problem, setProblem] = useState<Problem | null>(null)
  const [asked, setAsked] = useState(false)
  const refresh = useCallback(async () => {
    try {
      const all = await ask(api.GET('/api/v1/measurements'))
      setList(
        all.filter(
          (each) =>
            each.kind.startsWith(kind) ||
            each.problem !== '' ||
            (kind === 'sweep-' && each.kind === IMPORTED),
        ),
      )
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
    setAsked(true)
  }, [kind])
  useEffect(() => {
    if (open) void refresh()
  }, [open, refresh])
  return { list, problem, refresh, asked }
}

/** One stored measurement, evaluated again by the server; null while it is not there. */
export function useMeasurement(file: string | null) {
  const [found, setFound] = useState<{ file: string; content: MeasurementContent } | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  useEffect(() => {
    setProblem(null)
    if (file === null) return
    let current = true
    ask(api.GET('/api/v1/measurements/{name}', { params: { path: { name: file } } })).then(
      (content) => current && setFound({ file, content }),
      (error: unknown) => current && setProblem(problemOf(error)),
    )
    return () => {
      current = false
    }
  }, [file])
  return { content: file !== null && found?.file === file ? found.content : null, problem }
}

/** One stored response; null while it is not there. */
export function useSweep(file: string | null) {
  const { content, problem } = useMeasurement(file)
  return { content, sweep: content ? asSweep(content.result) : null, problem }
}
