import { href } from '../../app/navigation/router'
import { useSay, useT } from '../../i18n'
import type { DriveSummary } from '../../api/schema'
import { useAxisState, useDrive, useLink } from '../../live/store'
import { useJobEnd, useJobEnds } from '../../widgets/jobs/JobNote'
import { Panel } from '../../widgets/layout/Panel'
import { useBuses } from '../../live/buses'
import { useLimits } from '../response/plot/limits'
import { useMeasurable } from '../response/measure/useMeasurable'
import '../response/response.css'
import { asAutotune } from '../response/results'
import { useChanges } from '../response/design/undo'
import { useGains } from '../response/design/useGains'
import { useMeasurements } from '../response/useMeasurements'
import { useNewestJobs } from '../response/useToolJob'
import { AutotunePanel } from './autotune/AutotunePanel'
import { CandidatesPanel } from './autotune/CandidatesPanel'
import { CyclePanel } from './tools/cycle/CyclePanel'
import { Fold } from './path/Fold'
import { BrakePanel } from './tools/BrakePanel'
import { FirstPowerPanel } from './tools/FirstPowerPanel'
import { FrictionPanel } from './tools/friction/FrictionPanel'
import { GainsPanel } from './steps/GainsPanel'
import { GantryPanel } from './tools/gantry/GantryPanel'
import { HealthPanel } from './health/HealthPanel'
import { InertiaPanel } from './steps/InertiaPanel'
import { LoadSidePanel } from './tools/load-side/LoadSidePanel'
import { type Known, later, nextStep, type StepName, STEPS, stepsDone, tunedAt } from './path/path'
import { PathNav } from './path/PathNav'
import { PreChecks } from './steps/PreChecks'
import { SafetyPanel } from './tools/safety/SafetyPanel'
import { ShapingPanel } from './tools/shaping/ShapingPanel'
import { ReportPanel, useReports } from './steps/ReportPanel'
import { DwellPanel, VibrationPanel } from './tools/vibration/VibrationPanel'
import { newestInertia } from './autotune/newest'
import { present, type Section, useSections } from './path/sections'
import { StepPanel } from './steps/StepPanel'
import { checked, preChecks } from './steps/steps'

/** The guided path; every step can also be done alone. */
export function TunePage({ drive }: { drive: string }) {
  const summary = useDrive(drive)
  // Another axis has another present step.
  return summary && <TunePath key={drive} drive={drive} summary={summary} />
}

/** Where the panel of a tool stands, by the kind of its jobs. */
const SECTIONS: Record<string, Section> = {
  autotune: 'automatic',
  inertia: 'inertia',
  step: 'verify',
  'first-power': 'first',
  cycle: 'more',
  shaping: 'more',
  vibration: 'more',
  dwell: 'more',
  friction: 'more',
  'load-side': 'more',
  gantry: 'more',
  'brake-test': 'more',
  health: 'more',
  'safety-check': 'more',
}

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
  const jobs = useNewestJobs(drive)
  const job = (kind: string) => jobs.get(kind) ?? null
  const tuneJob = job('autotune')
  useJobEnds(jobs, () => void measured.refresh())
  useJobEnd(tuneJob?.id ?? null, () => void gains.read())
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
  const found = newestInertia(job('inertia'), tuneJob)
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
  const now: Section[] = possible
    ? present(done, {
        automatic: designable,
        tuned: tuned?.applied != null,
        running:
          Object.entries(SECTIONS).find(([kind]) => job(kind)?.state === 'running')?.[1] ?? null,
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
