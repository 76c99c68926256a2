import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import type { AxisHealth, HealthSettings } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob } from '../../live/store'
import { dateTime } from '../../widgets/format'
import { JobNote, useJobEnd } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useAction } from '../../widgets/useAction'
import type { Limits } from '../response/limits'
import { useToolJob } from '../response/useToolJob'
import { CHECK_ROUNDS, LEAST_ROUNDS } from './health'
import { HealthPermission } from './HealthPermission'
import { HealthStations } from './HealthStations'
import { HealthTrend } from './HealthTrend'
import { Findings, SignBaseline } from './HealthVerdict'
import { MotionWarning } from './MotionWarning'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'
import { useHealth } from './useHealth'

/** Measure a baseline, sign it, repeat it with one press, and what has changed since. */
export function HealthPanel({
  drive,
  limits,
  obstacle,
  cycleMs,
}: {
  drive: string
  limits: Limits | null
  /** What is in the way of a measurement, as text. */
  obstacle: string | null
  cycleMs: number
}) {
  const t = useT()
  const { tool, text } = useTool('health')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  useEffect(() => setValues({ ...initialValues(fields), rounds: LEAST_ROUNDS }), [fields])
  const { health, problem, refresh, setHealth } = useHealth(drive)
  const { job, note, dismiss } = useToolJob(drive, 'health')
  useJobEnd(job?.id ?? null, () => void refresh())
  const start = useAction()
  if (!tool) return null
  const go = (body: HealthSettings) =>
    start.run(async () => {
      const params = { path: { drive_id: drive } }
      setJob(await ask(api.POST('/api/v1/drives/{drive_id}/jobs/health', { params, body })))
    })
  const measure = () =>
    limits && void go({ ...limits, cycle_ms: cycleMs, ...values } as HealthSettings)
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      {health?.baseline && (
        <Repeat
          health={health}
          obstacle={obstacle}
          busy={start.busy}
          onStart={(body) => void go({ ...body, consent: limits?.consent ?? false })}
        />
      )}
      <details open={health !== null && !health.baseline}>
        <summary>{t('health.measure')}</summary>
        <ToolForm
          tool={tool}
          limits={limits}
          fields={fields}
          values={values}
          text={text}
          onChange={setValues}
        />
        <StartButton
          obstacle={obstacle ?? (complete(fields, values) ? null : t('start.incomplete'))}
          busy={start.busy}
          onStart={measure}
        >
          {text('start')}
        </StartButton>
      </details>
      <ProblemNote problem={start.problem ?? problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {health && <Findings health={health} />}
      {health && <SignBaseline drive={drive} health={health} onSigned={setHealth} />}
      {health && health.runs.length > 0 && <HealthTrend runs={health.runs} />}
      {health?.baseline && <HealthPermission drive={drive} job={job} />}
      <HealthStations />
    </Panel>
  )
}

/** The same measurements with the same settings, by one press. */
function Repeat({
  health,
  obstacle,
  busy,
  onStart,
}: {
  health: AxisHealth
  obstacle: string | null
  busy: boolean
  onStart: (settings: HealthSettings) => void
}) {
  const t = useT()
  const baseline = health.baseline
  if (!baseline) return null
  // The baseline's own limits count, whatever the form of the limits has now: only then it
  // compares.
  const settings = { ...baseline.settings, rounds: CHECK_ROUNDS } as unknown as HealthSettings
  return (
    <>
      <p className="num">
        {t('health.baseline', {
          when: dateTime(baseline.signed),
          person: baseline.person,
          rounds: baseline.runs.length,
        })}
      </p>
      <p className="dim num">
        {t('health.limits', {
          travel: settings.travel_limit,
          speed: settings.speed_limit,
          torque: settings.torque_limit,
        })}
      </p>
      <MotionWarning limits={settings} />
      <StartButton obstacle={obstacle} busy={busy} onStart={() => onStart(settings)}>
        {t('health.repeat')}
      </StartButton>
    </>
  )
}
