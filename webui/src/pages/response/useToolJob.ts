import { useState } from 'react'
import type { JobInfo } from '../../api/schema'
import { useJobs } from '../../live/store'

/** The newest job of a kind on an axis, also one that was started from another page. */
export function useToolJob(drive: string, kind: string) {
  const jobs = useJobs()
  const [dismissed, setDismissed] = useState<string | null>(null)
  let job: JobInfo | null = null
  for (const each of jobs.values()) {
    if (each.kind === kind && each.drive === drive && (!job || each.started > job.started)) {
      job = each
    }
  }
  const note = job && job.id !== dismissed && job.state !== 'done' ? job.id : null
  return { job, note, dismiss: () => setDismissed(job?.id ?? null) }
}
