import { href } from '../../app/router'
import { useSay, useT } from '../../i18n'
import { useAxisState, useDrive, useLink } from '../../live/store'
import { useJobEnd } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { useBuses } from '../connect/useBuses'
import { useLimits } from '../response/limits'
import { useMeasurable } from '../response/useMeasurable'
import '../response/response.css'
import { asAutotune, asInertia } from '../response/results'
import { useChanges } from '../response/undo'
import { useGains } from '../response/useGains'
import { useMeasurements } from '../response/useMeasurements'
import { useToolJob } from '../response/useToolJob'
import { AutotunePanel } from './AutotunePanel'
import { CandidatesPanel } from './CandidatesPanel'
import { BrakePanel } from './BrakePanel'
import { FirstPowerPanel } from './FirstPowerPanel'
import { FrictionPanel } from './FrictionPanel'
import { GainsPanel } from './GainsPanel'
import { HealthPanel } from './HealthPanel'
import { InertiaPanel } from './InertiaPanel'
import { type Known, later, tunedAt } from './path'
import { PathNav } from './PathNav'
import { PreChecks } from './PreChecks'
import { ReportPanel, useReports } from './ReportPanel'
import { StepPanel } from './StepPanel'
import { preChecks, ready } from './steps'

/** The guided path; every step can also be done alone. */
export function TunePage({ drive }: { drive: string }) {
  const t = useT()
  const say = useSay()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const { buses, refresh } = useBuses()
  const { possible, cycleMs } = useMeasurable(summary, state)
  const { open } = useLink()
  const limits = useLimits(drive)
  const gains = useGains(drive)
  const measured = useMeasurements('')
  const reports = useReports()
  const changes = useChanges(drive)
  const inertiaJob = useToolJob(drive, 'inertia').job
  const tuneJob = useToolJob(drive, 'autotune').job
  const stepJob = useToolJob(drive, 'step').job
  const frictionJob = useToolJob(drive, 'friction').job
  const brakeJob = useToolJob(drive, 'brake-test').job
  const firstJob = useToolJob(drive, 'first-power').job
  useJobEnd(inertiaJob?.id ?? null, () => void measured.refresh())
  useJobEnd(frictionJob?.id ?? null, () => void measured.refresh())
  useJobEnd(brakeJob?.id ?? null, () => void measured.refresh())
  useJobEnd(firstJob?.id ?? null, () => void measured.refresh())
  useJobEnd(stepJob?.id ?? null, () => void measured.refresh())
  useJobEnd(tuneJob?.id ?? null, () => {
    void measured.refresh()
    void gains.read()
  })
  const tuned = asAutotune(tuneJob?.result)
  if (!summary) return null
  const bus =
    buses.find(
      (each) => each.cyclic_possible && summary.ports.some((port) => port.url === each.url),
    ) ?? null
  const checks = preChecks(summary, state, { possible, running: bus?.cyclic?.running ?? false })
  const able = ready(checks)
  const missing = checks.find((each) => !each.ok && !each.optional)
  const obstacle = !open
    ? t('start.noConnection')
    : missing
      ? [t(`tune.no.${missing.name}`), say.message(missing.message, missing.detail)]
          .join(' ')
          .trim()
      : !limits.limits
        ? t('start.limits')
        : limits.agreed
          ? null
          : t('start.agree')
  const found = asInertia(inertiaJob?.result) ?? tuned?.inertia ?? null
  const si = found?.identifiable && found.unit === 'SI' ? found.inertia_kgm2 : null
  const designable = gains.gains !== null && gains.gains.convention !== 'unit'
  const ours = measured.list.filter(
    (each) => each.profile === summary.profile && each.drive === summary.name,
  )
  const mechanics = measured.list.filter(
    (each) => each.kind === 'sweep-mechanics' && each.profile === summary.profile,
  )
  const path: Known = {
    ready: able,
    inertia: si !== null,
    changed: later(changes.at(-1)?.time ?? null, tuned && tuneJob ? tunedAt(tuned, tuneJob) : null),
    measured: ours,
    reported: reports.list[0]?.made ?? null,
  }
  return (
    <div className="page">
      <h1>
        {t('page.tune')} <small className="dim">{summary.name}</small>
      </h1>
      {possible && (
        // It has its place before it is known how far one has come, which moves what is below it.
        <div className={measured.asked && reports.asked ? 'arrived' : 'arriving'}>
          <PathNav drive={drive} known={path} />
        </div>
      )}
      {state && !possible && <p className="note info">{t('tune.needsCyclic')}</p>}
      <div className="columns">
        <div className="stack">
          <div id="step-checks">
            <PreChecks
              drive={summary}
              checks={checks}
              bus={bus}
              limits={limits}
              cycleMs={cycleMs}
              onChange={refresh}
            />
          </div>
          {possible && <FirstPowerPanel drive={drive} obstacle={obstacle} cycleMs={cycleMs} />}
          {possible && designable && (
            <AutotunePanel
              drive={drive}
              state={state}
              limits={limits.agreed ? limits.limits : null}
              obstacle={obstacle}
              cycleMs={cycleMs}
              now={gains.gains?.raw ?? null}
              onChanged={() => void gains.read()}
            />
          )}
          {possible && (
            <div id="step-inertia">
              <InertiaPanel
                drive={drive}
                state={state}
                limits={limits.agreed ? limits.limits : null}
                obstacle={obstacle}
                cycleMs={cycleMs}
              />
            </div>
          )}
          <div id="step-gains">
            <GainsPanel drive={drive} of={gains} inertia={si} />
          </div>
        </div>
        <div className="stack">
          {gains.gains && !designable && (
            <Panel title={t('autotune.title')}>
              <p className="note info">
                {t('autotune.noMeaning')} <a href={href('gains', drive)}>{t('gains.toPage')}</a>
              </p>
            </Panel>
          )}
          {possible && (
            <StepPanel
              drive={drive}
              limits={limits.agreed ? limits.limits : null}
              obstacle={obstacle}
              cycleMs={cycleMs}
              stored={ours.filter((each) => each.kind === 'step')}
            />
          )}
          {possible && (
            <FrictionPanel
              drive={drive}
              limits={limits.agreed ? limits.limits : null}
              obstacle={obstacle}
              cycleMs={cycleMs}
            />
          )}
          {possible && (
            <BrakePanel
              drive={drive}
              limits={limits.agreed ? limits.limits : null}
              obstacle={obstacle}
              cycleMs={cycleMs}
            />
          )}
          {possible && (
            <HealthPanel
              drive={drive}
              limits={limits.agreed ? limits.limits : null}
              obstacle={obstacle}
              cycleMs={cycleMs}
            />
          )}
          <div id="step-report">
            <ReportPanel drive={drive} of={reports} />
          </div>
        </div>
      </div>
      {designable && gains.gains && (
        <CandidatesPanel
          drive={drive}
          list={mechanics}
          gains={gains.gains}
          inertia={si}
          onApplied={gains.read}
        />
      )}
    </div>
  )
}
