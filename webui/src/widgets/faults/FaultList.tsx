import type { ActiveFault } from '../../api/schema'
import { useT } from '../../i18n'
import { Icon } from '../layout/Icon'
import { ParameterText } from '../parameters/ParameterText'
import { OriginalSwitch, ProfileText } from '../profile-text/ProfileText'

/** Faults and warnings with cause and remedy from the manual. */
export function FaultList({ drive, faults }: { drive: string; faults: ActiveFault[] }) {
  const t = useT()
  return (
    <>
      {faults.length > 0 && <OriginalSwitch />}
      <ul className="faults">
        {faults.map((fault) => (
          <li key={`${fault.code} ${fault.name}`} className={fault.kind}>
            <h3>
              <Icon name="alarms" /> <span className="mono">{fault.code}</span>{' '}
              <ProfileText drive={drive} text={fault.name} />{' '}
              <small>{t(`faults.${fault.kind}`)}</small>
            </h3>
            {fault.causes.length > 0 && (
              <>
                <h4>{t('faults.causes')}</h4>
                <ul>
                  {fault.causes.map((text) => (
                    <li key={text}>
                      <ParameterText drive={drive} text={text} />
                    </li>
                  ))}
                </ul>
              </>
            )}
            {fault.remedies.length > 0 && (
              <>
                <h4>{t('faults.remedies')}</h4>
                <ul>
                  {fault.remedies.map((text) => (
                    <li key={text}>
                      <ParameterText drive={drive} text={text} />
                    </li>
                  ))}
                </ul>
              </>
            )}
            {fault.reset && (
              <p>
                <strong>{t('faults.resetHow')}</strong>{' '}
                <ParameterText drive={drive} text={fault.reset} />
              </p>
            )}
            <p className="dim">{t('source', { source: fault.source })}</p>
          </li>
        ))}
      </ul>
    </>
  )
}
