import type { JobInfo } from '../../../api/schema'
import { asAutotune, asInertia, type Inertia } from '../../response/results'

type Job = Pick<JobInfo, 'started' | 'result'> | null

/** The inertia measured last, whether alone or by an automatic tuning. */
export function newestInertia(alone: Job, tuning: Job): Inertia | null {
  const own = asInertia(alone?.result)
  const tuned = asAutotune(tuning?.result)?.inertia ?? null
  if (!alone || !tuning || !own || !tuned) return own ?? tuned
  return Date.parse(tuning.started) > Date.parse(alone.started) ? tuned : own
}
