import { useState } from 'react'
import type { JobInfo } from '../../api/schema'
import { useJobs } from '../../live/store'

/** The newest job of each kind on an axis, also those that were started from another page. */
export function useNewestJobs(drive: string): ReadonlyMap<string, JobInfo> {
  const newest = new Map<string, JobInfo>()
  for (const each of useJobs().values()) {
    if (each.drive === drive && each.started > (newest.get(each.kind)?.started ?? '')) {
      newest.set(each.kind, each)
    }
  }
  return newest
}

/** The newest job of a kind on an axis, and its note until somebody closes it. */
export function useToolJob(drive: string, kind: string) {
  const [dismissed, setDismissed] = useState<string | null>(null)
  const job = useNewestJobs(drive).get(kind) ?? null
  const note = job && job.id !== dismissed && job.state !== 'done' ? job.id : null
  return { job, note, dismiss: () => setDismissed(job?.id ?? null) }
}
