import { Button } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { JobInfo } from '../../api/schema'
import { type Say, type T, useSay, useT } from '../../i18n'
import { serverNow } from '../../live/server-clock'
import { setJob, useJob } from '../../live/store'
import { clock, duration } from '../numbers/format'
import { ProblemNote } from '../messages/ProblemNote'
import { useAction } from '../requests/useAction'

/** How long the good end of a job is reported. */
const DONE_MS = 6000

/** Progress of a job: step, elapsed and remaining time, cancel; then how it ended. */
export function JobNote({ id, onClose }: { id: string | null; onClose?: () => void }) {
  const t = useT()
  const say = useSay()
  const job = useJob(id)
  const done = job?.state === 'done'
  useEffect(() => {
    if (!done || !onClose) return
    const timer = setTimeout(onClose, DONE_MS)
    return () => clearTimeout(timer)
    // Counted from the end of the job, not from the last render.
  }, [done, id])
  const now = useNow(job?.state === 'running')
  const cancel = useAction()
  if (!job) return null
  if (job.state === 'failed') {
    return job.problem ? (
      <ProblemNote
        problem={job.problem}
        about={`${say.title(job)} · ${clock(job.ended)}`}
        {...(onClose ? { onClose } : {})}
      />
    ) : (
      <p className="note fault">{t('job.failed', { title: say.title(job) })}</p>
    )
  }
  if (job.state !== 'running') {
    return (
      <p className={`note ${job.state === 'done' ? 'good' : 'warn'}`} role="status">
        {ended(job, t, say)} <span className="num">{duration(seconds(job, now))}</span>
        {onClose && (
          <button type="button" className="plain" onClick={onClose}>
            {t('close')}
          </button>
        )}
      </p>
    )
  }
  const elapsed = seconds(job, now)
  return (
    <div className="job" role="status">
      <div className="job-line">
        <strong>{say.title(job)}</strong>
        <span className="grow">{say.step(job)}</span>
        <span className="num">{t('job.elapsed', { time: duration(elapsed) })}</span>
        {job.progress > 0.02 && elapsed > 1 && (
          <span className="num">
            {t('job.remaining', {
              time: duration((elapsed * (1 - job.progress)) / job.progress),
            })}
          </span>
        )}
        <Button
          loading={cancel.busy}
          onClick={() =>
            void cancel.run(async () =>
              setJob(
                await ask(
                  api.DELETE('/api/v1/jobs/{job_id}', { params: { path: { job_id: job.id } } }),
                ),
              ),
            )
          }
        >
          {t('cancel')}
        </Button>
      </div>
      <progress
        max={1}
        value={job.progress > 0 ? job.progress : undefined}
        aria-label={say.title(job)}
      />
      <ProblemNote problem={cancel.problem} onClose={cancel.clear} />
    </div>
  )
}

/** How a job ended; where it was cancelled, why, and what to do about it. */
function ended(job: JobInfo, t: T, say: Say): string {
  const title = say.title(job)
  if (job.state === 'done') return t('job.done', { title })
  const why = job.cancellation
  if (!why) return t('job.cancelled', { title })
  const cause = say.message(why.cause_message, why.cause)
  const remedy = say.message(why.remedy_message, why.remedy ?? '')
  return t(remedy ? 'job.cancelledRemedy' : 'job.cancelledBecause', { title, cause, remedy })
}

function seconds(job: JobInfo, now: number): number {
  return ((job.ended ? Date.parse(job.ended) : now) - Date.parse(job.started)) / 1000
}

function useNow(ticking: boolean): number {
  const [now, setNow] = useState(serverNow)
  useEffect(() => {
    if (!ticking) return
    const timer = setInterval(() => setNow(serverNow()), 500)
    return () => clearInterval(timer)
  }, [ticking])
  return now
}

/** Where a job's end matters: calls back once when it is over. */
export function useJobEnd(id: string | null, ended: (job: JobInfo) => void): void {
  const job = useJob(id)
  const over = job !== null && job.state !== 'running'
  useEffect(() => {
    if (over && job) ended(job)
    // Only the end itself counts, not every new closure.
  }, [over, id])
}

/** Calls back when one of these jobs is over, once for each. */
export function useJobEnds(jobs: ReadonlyMap<string, JobInfo>, ended: () => void): void {
  const over = [...jobs.values()].filter((each) => each.state !== 'running').map((each) => each.id)
  useEffect(() => {
    if (over.length > 0) ended()
    // Only the ends themselves count, not every new closure.
  }, [over.join()])
}
