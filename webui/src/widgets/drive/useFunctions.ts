import { useCallback, useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { AxisRecordInfo, Functions, Problem } from '../../api/schema'
import { publish, useLink, useStore, whenGone } from '../../live/store'

const known = new Map<string, Functions>()

/** What the drive's functions consist of; null until it is known. Of one drive it never changes. */
export function useFunctions(drive: string): Functions | null {
  const { open } = useLink()
  const functions = useStore(`functions ${drive}`, () => known.get(drive) ?? null)
  useEffect(() => {
    if (!open || known.has(drive)) return
    ask(
      api.GET('/api/v1/drives/{drive_id}/functions', { params: { path: { drive_id: drive } } }),
    ).then(
      (found) => {
        known.set(drive, found)
        publish(`functions ${drive}`)
      },
      () => {}, // asked again when the connection is back
    )
  }, [drive, open, functions === null])
  return functions
}

const records = new Map<string, AxisRecordInfo>()

whenGone((drive) => {
  known.delete(drive)
  records.delete(drive)
  publish(`functions ${drive}`)
  publish(`record ${drive}`)
})

export function setRecord(drive: string, record: AxisRecordInfo): void {
  records.set(drive, record)
  publish(`record ${drive}`)
}

/** Mechanics and watch list that the bench keeps of an axis. */
export function useRecord(drive: string): AxisRecordInfo | null {
  const { open } = useLink()
  const record = useStore(`record ${drive}`, () => records.get(drive) ?? null)
  useEffect(() => {
    if (!open) return
    ask(
      api.GET('/api/v1/drives/{drive_id}/record', { params: { path: { drive_id: drive } } }),
    ).then(
      (found) => setRecord(drive, found),
      () => {}, // asked again when the connection is back
    )
  }, [drive, open])
  return record
}

/** Answers that mean "not now": the link is gone, or the drive did not answer in time. */
const NOT_NOW = new Set([503, 504])
const AGAIN_MS = 2000

/**
 * Something read from the drive on opening a page, and again on request. Where the drive did not
 * answer it is asked again every two seconds, so that a page heals by itself.
 */
export function useFetched<T>(fetch: () => Promise<T>, dependencies: unknown[]) {
  const { open } = useLink()
  const [data, setData] = useState<T | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  const read = useCallback(async () => {
    try {
      setData(await fetch())
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
  }, dependencies)
  useEffect(() => {
    if (open) void read()
  }, [read, open])
  useEffect(() => {
    if (!open || !problem || !NOT_NOW.has(problem.status)) return
    const timer = setTimeout(() => void read(), AGAIN_MS)
    return () => clearTimeout(timer)
  }, [read, open, problem])
  return { data, problem, read, setData }
}
