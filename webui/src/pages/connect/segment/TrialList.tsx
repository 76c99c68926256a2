import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DoctorTrial, StationDiagnosis, TrialResult } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { JobNote, useJobEnd } from '../../../widgets/jobs/JobNote'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

/** Settings of the bring-up that may be the cause: try one, see the state, keep or undo it. */
export function TrialList({
  url,
  diagnosis,
  onChanged,
}: {
  url: string
  diagnosis: StationDiagnosis
  onChanged: () => Promise<void>
}) {
  const t = useT()
  const { station, trials = [], kept } = diagnosis
  const [id, setId] = useState<string | null>(null)
  const [result, setResult] = useState<TrialResult | null>(null)
  const act = useAction()
  useJobEnd(id, (job) => {
    if (job.state === 'done') setResult(job.result as unknown as TrialResult)
    if (job.state !== 'failed') setId(null)
  })
  const start = (trial: DoctorTrial) =>
    act.run(async () => {
      setResult(null)
      const body = { url, station, setting: trial.setting, after: trial.after }
      const job = await ask(api.POST('/api/v1/buses/doctor/trials', { body }))
      setJob(job)
      setId(job.id)
    })
  const keep = (tried: TrialResult) =>
    act.run(async () => {
      const body = { url, station, setting: tried.setting, after: tried.after }
      await ask(api.PUT('/api/v1/buses/doctor/kept', { body }))
      setResult(null)
      await onChanged()
    })
  const undo = () =>
    act.run(async () => {
      await ask(api.DELETE('/api/v1/buses/doctor/kept', { params: { query: { url, station } } }))
      await onChanged()
    })
  if (trials.length === 0 && !kept && !result) return null
  return (
    <section aria-label={t('segment.trials')}>
      <h5>{t('segment.trials')}</h5>
      {kept && (
        <div className="note warn row">
          <span className="grow">{t('segment.trialKept', named(kept))}</span>
          <Button loading={act.busy} onClick={() => void undo()}>
            {t('segment.trialUndo')}
          </Button>
        </div>
      )}
      {trials.length > 0 && (
        <>
          <p className="dim">{t('segment.trialsHelp')}</p>
          <ul className="plain-list">
            {trials.map((trial) => (
              <li key={`${trial.setting} ${trial.after}`} className="row">
                <span className="grow num">{t('segment.trial', named(trial))}</span>
                <Button
                  loading={act.busy}
                  disabled={id !== null}
                  aria-label={t('segment.tryThis', named(trial))}
                  onClick={() => void start(trial)}
                >
                  {t('segment.try')}
                </Button>
              </li>
            ))}
          </ul>
        </>
      )}
      <JobNote id={id} onClose={() => setId(null)} />
      {result && (
        <TrialOutcome
          result={result}
          keepable={trials.some(
            (trial) =>
              trial.setting === result.setting && trial.after === result.after && trial.of_profile,
          )}
          busy={act.busy}
          onKeep={() => void keep(result)}
          onUndo={() => setResult(null)}
        />
      )}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </section>
  )
}

/** How the trial ended; nothing of it holds until it is kept. */
function TrialOutcome({
  result,
  keepable,
  busy,
  onKeep,
  onUndo,
}: {
  result: TrialResult
  keepable: boolean
  busy: boolean
  onKeep: () => void
  onUndo: () => void
}) {
  const t = useT()
  const say = useSay()
  const facts = { setting: result.setting, after: result.after }
  if (!result.reached) {
    const why = say.message(result.refusal) || t('segment.trialNoReason')
    return (
      <p className="note warn" role="status">
        {t('segment.trialFailed', { ...facts, why })}
      </p>
    )
  }
  return (
    <div className="note good" role="status">
      <p>{t('segment.trialReached', facts)}</p>
      {keepable ? (
        <div className="row">
          <Button variant="filled" loading={busy} onClick={onKeep}>
            {t('segment.trialKeep')}
          </Button>
          <Button disabled={busy} onClick={onUndo}>
            {t('segment.trialUndo')}
          </Button>
        </div>
      ) : (
        <p>{t('segment.trialCycle')}</p>
      )}
    </div>
  )
}

function named(trial: DoctorTrial) {
  return { setting: trial.setting, before: trial.before, after: trial.after }
}
