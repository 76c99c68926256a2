import { href } from '../../app/router'
import { useSay, useT } from '../../i18n'
import type { DriveSummary, JobInfo } from '../../api/schema'
import { useAxisState, useDrive, useLink } from '../../live/store'
import { useJobEnd } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { useBuses } from '../../live/buses'
import { useLimits } from '../response/limits'
import { useMeasurable } from '../response/useMeasurable'
import '../response/response.css'
import { asAutotune } from '../response/results'
import { useChanges } from '../response/undo'
import { useGains } from '../response/useGains'
import { useMeasurements } from '../response/useMeasurements'
import { useToolJob } from '../response/useToolJob'
import { AutotunePanel } from './AutotunePanel'
import { CandidatesPanel } from './CandidatesPanel'
import { CyclePanel } from './CyclePanel'
import { Fold } from './Fold'
import { BrakePanel } from './BrakePanel'
import { FirstPowerPanel } from './FirstPowerPanel'
import { FrictionPanel } from './FrictionPanel'
import { GainsPanel } from './GainsPanel'
import { GantryPanel } from './GantryPanel'
import { HealthPanel } from './HealthPanel'
import { InertiaPanel } from './InertiaPanel'
import { LoadSidePanel } from './LoadSidePanel'
import { type Known, later, nextStep, type StepName, STEPS, stepsDone, tunedAt } from './path'
import { PathNav } from './PathNav'
import { PreChecks } from './PreChecks'
import { SafetyPanel } from './SafetyPanel'
import { ShapingPanel } from './ShapingPanel'
import { ReportPanel, useReports } from './ReportPanel'
import { DwellPanel, VibrationPanel } from './VibrationPanel'
import { newestInertia } from './newest'
import { present, type Section, useSections } from './sections'
import { StepPanel } from './StepPanel'
import { checked, preChecks } from './steps'

/** The guided path; every step can also be done alone. */
export function TunePage({ drive }: { drive: string }) {
  const summary = useDrive(drive)
  // Another axis has another present step.
  return summary && <TunePath key={drive} drive={drive} summary={summary} />
}

const running = (job: JobInfo | null) => job?.state === 'running'

function TunePath({ drive, summary }: { drive: string; summary: DriveSummary }) {
  const t = useT()
  const say = useSay()
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
  const loadSideJob = useToolJob(drive, 'load-side').job
  const gantryJob = useToolJob(drive, 'gantry').job
  const brakeJob = useToolJob(drive, 'brake-test').job
  const firstJob = useToolJob(drive, 'first-power').job
  const healthJob = useToolJob(drive, 'health').job
  const safetyJob = useToolJob(drive, 'safety-check').job
  const shapingJob = useToolJob(drive, 'shaping').job
  const vibrationJob = useToolJob(drive, 'vibration').job
  const dwellJob = useToolJob(drive, 'dwell').job
  const cycleJob = useToolJob(drive, 'cycle').job
  useJobEnd(inertiaJob?.id ?? null, () => void measured.refresh())
  useJobEnd(frictionJob?.id ?? null, () => void measured.refresh())
  useJobEnd(loadSideJob?.id ?? null, () => void measured.refresh())
  useJobEnd(gantryJob?.id ?? null, () => void measured.refresh())
  useJobEnd(brakeJob?.id ?? null, () => void measured.refresh())
  useJobEnd(firstJob?.id ?? null, () => void measured.refresh())
  useJobEnd(cycleJob?.id ?? null, () => void measured.refresh())
  useJobEnd(shapingJob?.id ?? null, () => void measured.refresh())
  useJobEnd(vibrationJob?.id ?? null, () => void measured.refresh())
  useJobEnd(dwellJob?.id ?? null, () => void measured.refresh())
  useJobEnd(stepJob?.id ?? null, () => void measured.refresh())
  useJobEnd(tuneJob?.id ?? null, () => {
    void measured.refresh()
    void gains.read()
  })
  const tuned = asAutotune(tuneJob?.result)
  const bus =
    buses.find(
      (each) => each.cyclic_possible && summary.ports.some((port) => port.url === each.url),
    ) ?? null
  const checks = preChecks(summary, state, { possible, running: bus?.cyclic?.running ?? false })
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
  const found = newestInertia(inertiaJob, tuneJob)
  const si = found?.identifiable && found.unit === 'SI' ? found.inertia_kgm2 : null
  const designable = gains.gains !== null && gains.gains.convention !== 'unit'
  const ours = measured.list.filter(
    (each) => each.profile === summary.profile && each.drive === summary.name,
  )
  const mechanics = measured.list.filter(
    (each) => each.kind === 'sweep-mechanics' && each.profile === summary.profile,
  )
  const path: Known = {
    ready: checked(checks, limits.agreed),
    inertia: si !== null,
    changed: later(changes.at(-1)?.time ?? null, tuned && tuneJob ? tunedAt(tuned, tuneJob) : null),
    measured: ours,
    reported: reports.list[0]?.made ?? null,
  }
  const done = stepsDone(path)
  const next = nextStep(done)
  const busy: [JobInfo | null, Section][] = [
    [tuneJob, 'automatic'],
    [inertiaJob, 'inertia'],
    [stepJob, 'verify'],
    [firstJob, 'first'],
    [frictionJob, 'more'],
    [loadSideJob, 'more'],
    [gantryJob, 'more'],
    [brakeJob, 'more'],
    [healthJob, 'more'],
    [safetyJob, 'more'],
    [cycleJob, 'more'],
    [shapingJob, 'more'],
    [vibrationJob, 'more'],
    [dwellJob, 'more'],
  ]
  const now: Section[] = possible
    ? present(done, {
        automatic: designable,
        tuned: tuned?.applied != null,
        running: busy.find(([job]) => running(job))?.[1] ?? null,
      })
    : ['checks', 'manual', 'gains']
  const of = useSections(now)
  // Before all of this is known, the present step is not, and nothing may open under a finger.
  const known =
    measured.asked && reports.asked && state !== null && (gains.gains ?? gains.problem) !== null
  const consented = limits.agreed ? limits.limits : null
  const step = (name: StepName) => ({
    of,
    name,
    number: STEPS.indexOf(name) + 1,
    title: t(`path.${name}`),
    state: done[name] ? ('done' as const) : name === next ? ('next' as const) : ('open' as const),
  })
  const measure = { drive, limits: consented, obstacle, cycleMs }
  return (
    <div className="page">
      <h1>
        {t('page.tune')} <small className="dim">{summary.name}</small>
      </h1>
      {possible && (
        // It has its place before it is known how far one has come, which moves what is below it.
        <div className={measured.asked && reports.asked ? 'arrived' : 'arriving'}>
          <PathNav drive={drive} known={path} onOpen={(name) => of.set(name, true)} />
        </div>
      )}
      {state && !possible && <p className="note info">{t('tune.needsCyclic')}</p>}
      <div
        className={`stack tune-path ${known || !open ? '' : 'arriving-path'}`}
        onPointerDownCapture={of.keep}
        onKeyDownCapture={of.keep}
      >
        <Fold {...step('checks')}>
          <PreChecks
            drive={summary}
            checks={checks}
            bus={bus}
            limits={limits}
            cycleMs={cycleMs}
            onChange={refresh}
          />
        </Fold>
        {possible && (
          <Fold of={of} name="first" title={t('fold.first')} help={t('fold.firstHelp')}>
            <FirstPowerPanel drive={drive} obstacle={obstacle} cycleMs={cycleMs} />
          </Fold>
        )}
        {possible && designable && (
          <Fold
            of={of}
            name="automatic"
            title={t('autotune.title')}
            help={t('fold.automaticHelp')}
            {...(now.includes('automatic') ? { state: 'next' as const } : {})}
            {...(tuned && done.verify ? { state: 'done' as const } : {})}
          >
            <AutotunePanel
              {...measure}
              state={state}
              now={gains.gains?.raw ?? null}
              onChanged={() => void gains.read()}
            />
          </Fold>
        )}
        {gains.gains && !designable && (
          <Panel title={t('autotune.title')}>
            <p className="note info">
              {t('autotune.noMeaning')} <a href={href('gains', drive)}>{t('gains.toPage')}</a>
            </p>
          </Panel>
        )}
        <Fold of={of} name="manual" title={t('fold.manual')} help={t('fold.manualHelp')}>
          {possible && (
            <>
              <Fold {...step('inertia')}>
                <InertiaPanel {...measure} state={state} />
              </Fold>
              <Fold {...step('response')}>
                <p>
                  {t('fold.response')} <a href={href('response', drive)}>{t('fold.toResponse')}</a>
                </p>
              </Fold>
              <Fold {...step('notches')}>
                <p>
                  {t('fold.notches')} <a href={href('response', drive)}>{t('fold.toResponse')}</a>
                </p>
                {designable && gains.gains && (
                  <CandidatesPanel
                    drive={drive}
                    name={summary.name}
                    list={mechanics}
                    gains={gains.gains}
                    inertia={si}
                    onApplied={gains.read}
                  />
                )}
              </Fold>
            </>
          )}
          <Fold {...step('gains')}>
            <GainsPanel drive={drive} of={gains} inertia={si} />
          </Fold>
          {possible && (
            <Fold {...step('verify')}>
              <p>
                {t('fold.verify')} <a href={href('response', drive)}>{t('fold.toResponse')}</a>
              </p>
              <StepPanel {...measure} stored={ours.filter((each) => each.kind === 'step')} />
            </Fold>
          )}
        </Fold>
        <Fold {...step('report')}>
          <ReportPanel drive={drive} of={reports} />
        </Fold>
        <Fold of={of} name="more" title={t('fold.more')} help={t('fold.moreHelp')}>
          <CyclePanel drive={drive} open={open} />
          {possible && (
            <>
              <ShapingPanel {...measure} />
              <VibrationPanel {...measure} />
              <DwellPanel {...measure} />
              <FrictionPanel {...measure} />
              <LoadSidePanel {...measure} />
              <GantryPanel {...measure} />
              <BrakePanel {...measure} />
              <HealthPanel {...measure} />
              <SafetyPanel {...measure} />
            </>
          )}
        </Fold>
      </div>
    </div>
  )
}
