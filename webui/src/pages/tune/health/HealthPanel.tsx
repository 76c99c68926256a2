import type { AxisHealth, HealthSettings } from '../../../api/schema'
import { useT } from '../../../i18n'
import { dateTime } from '../../../widgets/numbers/format'
import { useJobEnd } from '../../../widgets/jobs/JobNote'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { CHECK_ROUNDS, LEAST_ROUNDS } from './health'
import { HealthPermission } from './HealthPermission'
import { HealthStations } from './HealthStations'
import { HealthTrend } from './HealthTrend'
import { Findings, SignBaseline } from './HealthVerdict'
import { MotionWarning } from '../steps/MotionWarning'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../tools/form/ToolPanel'
import { useHealth } from './useHealth'

const INITIAL = { rounds: LEAST_ROUNDS }

/** Measure a baseline, sign it, repeat it with one press, and what has changed since. */
export function HealthPanel(measured: Measured) {
  const { drive, limits, obstacle } = measured
  const t = useT()
  const run = useToolRun('health', drive, { initial: INITIAL })
  const { health, problem, refresh, setHealth } = useHealth(drive)
  useJobEnd(run.job?.id ?? null, () => void refresh())
  return (
    <ToolPanel
      run={run}
      answer={
        <>
          <ProblemNote problem={problem} />
          {health && <Findings health={health} />}
          {health && <SignBaseline drive={drive} health={health} onSigned={setHealth} />}
          {health && health.runs.length > 0 && <HealthTrend runs={health.runs} />}
          {health?.baseline && <HealthPermission drive={drive} job={run.job} />}
          <HealthStations />
        </>
      }
    >
      {health?.baseline && (
        <Repeat
          health={health}
          obstacle={obstacle}
          busy={run.start.busy}
          onStart={(settings) => run.begin({ ...settings, consent: limits?.consent ?? false })}
        />
      )}
      <details open={health !== null && !health.baseline}>
        <summary>{t('health.measure')}</summary>
        <MeasuredStart run={run} measured={measured} />
      </details>
    </ToolPanel>
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
