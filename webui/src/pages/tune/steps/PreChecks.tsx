import { Button } from '@mantine/core'
import type { Bus, DriveSummary } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import * as live from '../../../live/live'
import { Icon } from '../../../widgets/layout/Icon'
import { Panel } from '../../../widgets/layout/Panel'
import { CyclicExchange } from '../../connect/buses/CyclicExchange'
import { LimitFields, type useLimits } from '../../response/plot/limits'
import type { Check } from './steps'

/** What is needed before anything moves, as text, with the way to it. */
export function PreChecks({
  drive,
  checks,
  bus,
  limits,
  cycleMs,
  onChange,
}: {
  drive: DriveSummary
  checks: Check[]
  bus: Bus | null
  limits: ReturnType<typeof useLimits>
  /** Cycle of the exchange that a measurement starts where none runs. */
  cycleMs: number
  onChange: () => Promise<void>
}) {
  const t = useT()
  const say = useSay()
  return (
    <Panel title={t('tune.checks')}>
      <ul className="checks">
        {checks.map((check) => (
          <li key={check.name}>
            <span
              className={check.ok ? 'good-text' : check.optional ? 'warn-text' : 'fault-text'}
              role="img"
              aria-label={t(check.ok ? 'tune.met' : check.optional ? 'tune.hint' : 'tune.missing')}
            >
              <Icon name={check.ok ? 'check' : check.optional ? 'clock' : 'cross'} />
            </span>
            <span className="grow">
              {t(check.ok ? `tune.ok.${check.name}` : `tune.no.${check.name}`, { ms: cycleMs })}
              {!check.ok && check.detail && (
                <strong> {say.message(check.message, check.detail)}</strong>
              )}
            </span>
            {!check.ok && check.name === 'faults' && (
              <a href={`#/axis/${encodeURIComponent(drive.id)}/alarms`}>{t('page.alarms')}</a>
            )}
            {!check.ok && check.name === 'pending' && (
              <a href={`#/axis/${encodeURIComponent(drive.id)}/parameters`}>
                {t('page.parameters')}
              </a>
            )}
            {check.name === 'control' && check.ok && !drive.lease.mine && (
              <Button onClick={() => live.send({ type: 'lease', drive: drive.id, take: true })}>
                {t('control.take')}
              </Button>
            )}
          </li>
        ))}
      </ul>
      {bus?.cyclic_possible && <CyclicExchange bus={bus} onChange={onChange} />}
      <h3>{t('tune.limits')}</h3>
      <p className="dim">{t('tune.limitsHelp')}</p>
      <LimitFields of={limits} />
      <p className="note warn">{t('tune.free')}</p>
    </Panel>
  )
}
