import { Checkbox, NativeSelect, SegmentedControl } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AutotuneRequest, AxisState } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { JobNote } from '../../../widgets/jobs/JobNote'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { useAction } from '../../../widgets/requests/useAction'
import { useWrong } from '../../../widgets/numbers/useWrong'
import { asAutotune } from '../../response/results'
import { useToolJob } from '../../response/useToolJob'
import { AutotuneReport } from './AutotuneReport'
import { SchemeFields, useScheme } from '../steps/schemes'
import { stepOf } from '../steps/steps'
import type { Measured } from '../tools/form/ToolPanel'

const MARKS = ['robust', 'balanced', 'fast'] as const
const LOADS = ['auto', 'stiff', 'medium', 'compliant'] as const
const STEPS = ['1', '2', '3', '4', '5', '6'] as const

/** All steps in one job, from inertia to a verified loop. */
export function AutotunePanel({
  drive,
  state,
  limits,
  obstacle,
  cycleMs,
  now,
  onChanged,
}: Measured & {
  state: AxisState | null
  /** Gains that the drive holds now, raw. */
  now: Record<string, number> | null
  onChanged: () => void
}) {
  const t = useT()
  const [mark, setMark] = useState<(typeof MARKS)[number]>('balanced')
  const [load, setLoad] = useState<(typeof LOADS)[number]>('auto')
  const [apply, setApply] = useState(true)
  const [motor, setMotor] = useState<number | null>(null)
  const wrong = useWrong()
  const scheme = useScheme()
  const start = useAction()
  const { job, note, dismiss } = useToolJob(drive, 'autotune')
  const running = job?.state === 'running' ? stepOf(job.step_message) : null
  const result = asAutotune(job?.result)
  const go = () =>
    start.run(async () => {
      if (!limits) return
      const body: AutotuneRequest = {
        ...limits,
        cycle_ms: cycleMs,
        mark,
        load: load === 'auto' ? null : load,
        loop: 'auto',
        scheme: scheme.scheme,
        ends_rev: scheme.ends,
        apply,
        motor_inertia_kgm2: motor,
      }
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/autotune', {
            params: { path: { drive_id: drive } },
            body,
          }),
        ),
      )
    })
  return (
    <Panel title={t('autotune.title')}>
      <p className="dim">{t('autotune.help')}</p>
      <SegmentedControl
        fullWidth
        value={mark}
        onChange={(next) => setMark(next)}
        data={MARKS.map((each) => ({ value: each, label: t(`mark.${each}`) }))}
      />
      <p className="dim">{t(`mark.help.${mark}`)}</p>
      <div className="fields wide">
        <NativeSelect
          label={t('candidate.load')}
          value={load}
          onChange={(event) => setLoad(event.currentTarget.value as typeof load)}
          data={LOADS.map((each) => ({ value: each, label: t(`load.${each}`) }))}
        />
        <SchemeFields of={scheme} state={state} />
        <NumberField
          label={t('inertia.motor')}
          unit="kg·m²"
          value={motor}
          onChange={setMotor}
          onWrong={wrong.of('motor')}
          above={0}
          optional
          help={t('autotune.motorHelp')}
        />
      </div>
      <Checkbox
        label={t('autotune.apply')}
        checked={apply}
        onChange={(event) => setApply(event.currentTarget.checked)}
      />
      {limits && (
        <p className="note warn">
          {t('autotune.moves', {
            travel: limits.travel_limit,
            speed: limits.speed_limit,
            torque: limits.torque_limit,
          })}
        </p>
      )}
      <StartButton
        obstacle={obstacle ?? (scheme.complete && !wrong.any ? null : t('start.incomplete'))}
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('autotune.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
      {job?.state === 'running' && (
        <ol className="steps">
          {STEPS.map((each) => {
            const now = running?.now ?? 1
            const place = Number(each) < now ? 'past' : Number(each) === now ? 'now' : ''
            return (
              <li key={each} className={place} aria-current={place === 'now' ? 'step' : undefined}>
                {each} {t(`autotune.step.${each}`)}
              </li>
            )
          })}
        </ol>
      )}
      <JobNote id={note} onClose={dismiss} />
      {result && job && (
        <AutotuneReport
          drive={drive}
          job={job.id}
          result={result}
          now={now}
          onChanged={onChanged}
        />
      )}
    </Panel>
  )
}
