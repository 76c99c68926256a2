import { href } from '../../app/router'
import { useT } from '../../i18n'
import { useAxisState, useDrive } from '../../live/store'
import { Panel } from '../../widgets/Panel'
import { useBuses } from '../connect/useBuses'
import { useCyclic } from '../motion/SignalPanel'
import { useLimits } from '../response/limits'
import { asAutotune, asInertia } from '../response/results'
import { useGains } from '../response/useGains'
import { useMeasurements } from '../response/useMeasurements'
import { useToolJob } from '../response/useToolJob'
import { AutotunePanel } from './AutotunePanel'
import { CandidatesPanel } from './CandidatesPanel'
import { GainsPanel } from './GainsPanel'
import { InertiaPanel } from './InertiaPanel'
import { PreChecks } from './PreChecks'
import { StepPanel } from './StepPanel'
import { preChecks, ready } from './steps'

/** The guided path; every step can also be done alone. */
export function TunePage({ drive }: { drive: string }) {
  const t = useT()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const { buses, refresh } = useBuses()
  const possible = useCyclic(summary, state)
  const limits = useLimits(drive)
  const gains = useGains(drive)
  const measured = useMeasurements()
  const inertiaJob = useToolJob(drive, 'inertia').job
  const tuned = asAutotune(useToolJob(drive, 'autotune').job?.result)
  if (!summary) return null
  const bus =
    buses.find(
      (each) => each.cyclic_possible && summary.ports.some((port) => port.url === each.url),
    ) ?? null
  const checks = preChecks(summary, state, { possible, running: bus?.cyclic?.running ?? false })
  const able = ready(checks)
  const found = asInertia(inertiaJob?.result) ?? tuned?.inertia ?? null
  const si = found?.identifiable && found.unit === 'SI' ? found.inertia_kgm2 : null
  const designable =
    gains.gains !== null &&
    gains.gains.convention !== 'unit' &&
    gains.gains.current_bandwidth_hz !== null
  const mechanics = measured.list.filter(
    (each) => each.kind === 'sweep-mechanics' && each.profile === summary.profile,
  )
  return (
    <div className="page">
      <h1>
        {t('page.tune')} <small className="dim">{summary.name}</small>
      </h1>
      {state && !possible && <p className="note info">{t('tune.needsCyclic')}</p>}
      <div className="columns">
        <div className="stack">
          <PreChecks drive={summary} checks={checks} bus={bus} limits={limits} onChange={refresh} />
          {possible && (
            <InertiaPanel drive={drive} state={state} limits={limits.limits} able={able} />
          )}
          <GainsPanel drive={drive} of={gains} inertia={si} />
          {possible && (
            <Panel title={t('tune.response')}>
              <p>{t('tune.responseText')}</p>
              <a className="big" href={href('response', drive)}>
                {t('page.response')}
              </a>
            </Panel>
          )}
        </div>
        <div className="stack">
          {possible && designable && (
            <AutotunePanel
              drive={drive}
              state={state}
              limits={limits.limits}
              able={able}
              onChanged={() => void gains.read()}
            />
          )}
          {possible && <StepPanel drive={drive} limits={limits.limits} able={able} />}
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
