import { useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { GainValues, PredictionInfo, Problem } from '../../api/schema'
import type { NotchShape } from './results'

const SETTLE_MS = 300

/** The speed loop that notches and gains would make of a stored response of the mechanics. */
export function usePrediction(
  drive: string,
  file: string | null,
  notches: (NotchShape | null)[],
  gains: GainValues | null,
) {
  const [found, setFound] = useState<PredictionInfo | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  const asked = JSON.stringify([drive, file, notches, gains])
  useEffect(() => {
    if (file === null || gains === null) {
      setFound(null)
      return
    }
    let current = true
    const timer = setTimeout(() => {
      ask(
        api.POST('/api/v1/drives/{drive_id}/tune/predict', {
          params: { path: { drive_id: drive } },
          body: { measurement: file, notches: notches.filter((each) => each !== null), gains },
        }),
      ).then(
        (made) => {
          if (!current) return
          setFound(made)
          setProblem(null)
        },
        (error: unknown) => {
          if (!current) return
          setFound(null)
          setProblem(problemOf(error))
        },
      )
    }, SETTLE_MS)
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, [asked])
  return { found, problem }
}
