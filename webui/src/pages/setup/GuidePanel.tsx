import { Button, Checkbox } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { Guide, ProcedureInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob, useAxisState } from '../../live/store'
import { JobNote } from '../../widgets/jobs/JobNote'
import { NumberField } from '../../widgets/numbers/NumberField'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterFields } from '../../widgets/parameters/ParameterFields'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { StartButton } from '../../widgets/jobs/StartButton'
import { ProcedureDialog, useProcedures } from '../../widgets/faults/Procedures'
import { useSay } from '../../widgets/profile-text/texts'
import { useAction } from '../../widgets/requests/useAction'
import { useFunctions } from '../../widgets/drive/useFunctions'
import { useObstacle } from '../../widgets/jobs/useObstacle'
import { useRemembered } from '../../widgets/browser/remembered'

/** A course of the drive's manual, step by step, with the parameters and procedures of each. */
export function GuidePanel({ drive, guide }: { drive: string; guide: Guide }) {
  const t = useT()
  const say = useSay(drive)
  const procedures = useProcedures(drive)
  const [chosen, setChosen] = useState<ProcedureInfo | null>(null)
  const [job, setShown] = useState<string | null>(null)
  return (
    <Panel title={say(guide.title)}>
      {guide.warning && (
        <p className="note warn">
          <ProfileText drive={drive} text={guide.warning} />
        </p>
      )}
      {guide.notes && (
        <p className="dim">
          <ProfileText drive={drive} text={guide.notes} />
        </p>
      )}
      <ol className="guide">
        {guide.steps.map((step, i) => {
          const procedure = procedures?.find((each) => each.name === step.procedure)
          return (
            <li key={step.title}>
              <h3>
                {t('guide.step', { n: i + 1 })}: {say(step.title)}
              </h3>
              <p className="prose">
                <ProfileText drive={drive} text={step.text} />
              </p>
              {(step.keys ?? []).length > 0 && (
                <ParameterFields drive={drive} keys={step.keys ?? []} />
              )}
              {step.procedure && procedures && !procedure && (
                <p className="note info">{t('guide.noProcedure')}</p>
              )}
              {step.identifies && <Identify drive={drive} onStarted={setShown} />}
              {procedure && (
                <Button variant="filled" onClick={() => setChosen(procedure)}>
                  {say(procedure.title)}: {t('guide.run')}
                </Button>
              )}
            </li>
          )
        })}
      </ol>
      <JobNote id={job} onClose={() => setShown(null)} />
      {(guide.failures ?? []).length > 0 && (
        <p>
          {t('guide.failures')}: <span className="mono">{guide.failures?.join(', ')}</span>
        </p>
      )}
      <p className="dim">{t('source', { source: guide.source })}</p>
      {chosen && (
        <ProcedureDialog
          drive={drive}
          procedure={chosen}
          onClose={() => setChosen(null)}
          onStarted={setShown}
        />
      )}
    </Panel>
  )
}

/** Starts the identification of the drive itself, within a travel and a time. */
function Identify({ drive, onStarted }: { drive: string; onStarted: (job: string) => void }) {
  const t = useT()
  const state = useAxisState(drive)
  const obstacle = useObstacle(drive)
  const spec = useFunctions(drive)?.identification
  const [travel, setTravel] = useRemembered(drive, 'identify.travel', null)
  const [time, setTime] = useRemembered(drive, 'identify.time', 120)
  const [agreed, setAgreed] = useState(false)
  const act = useAction()
  if (!spec) return null
  const start = () =>
    act.run(async () => {
      if (travel === null || time === null) return
      const job = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/identify', {
          params: { path: { drive_id: drive } },
          body: { confirmed: agreed, travel_limit: travel, torque_limit: 300, timeout_s: time },
        }),
      )
      setJob(job)
      setAgreed(false)
      onStarted(job.id)
    })
  return (
    <>
      <p className="note warn">
        <ProfileText drive={drive} text={spec.warning} />
      </p>
      <div className="fields">
        <NumberField
          label={t('motion.travelLimit')}
          unit={state?.units.position ?? ''}
          value={travel}
          onChange={setTravel}
          above={0}
        />
        <NumberField
          label={t('move.timeout')}
          unit="s"
          value={time}
          onChange={setTime}
          above={0}
          max={1200}
        />
      </div>
      <Checkbox
        label={t('identify.agree')}
        checked={agreed}
        onChange={(event) => setAgreed(event.currentTarget.checked)}
      />
      <StartButton
        obstacle={
          obstacle ??
          (travel === null || time === null
            ? t('start.incomplete')
            : agreed
              ? null
              : t('start.agree'))
        }
        busy={act.busy}
        onStart={() => void start()}
      >
        {t('identify.start')}
      </StartButton>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}
