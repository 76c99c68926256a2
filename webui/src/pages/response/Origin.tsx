import type { MeasurementContent } from '../../api/schema'
import { useT } from '../../i18n'
import { dateTime } from '../../widgets/numbers/format'

/** Settings as `name: value` with the envelope's own fields among them. */
export function flat(settings: Record<string, unknown>): [string, string][] {
  return Object.entries(settings).flatMap(([name, value]): [string, string][] => {
    if (value === null || value === undefined) return []
    if (typeof value === 'object' && !Array.isArray(value)) {
      return flat(value as Record<string, unknown>)
    }
    const text = typeof value === 'string' ? value : JSON.stringify(value)
    return [[name, Array.isArray(value) ? value.join(' … ') : text]]
  })
}

/** Where a result comes from: its raw signals evaluated again, and the settings of the measurement. */
export function Origin({ content }: { content: MeasurementContent }) {
  const t = useT()
  const { agrees, differences, info, program, profile_version, settings } = content
  return (
    <>
      <p className={agrees === false ? 'note warn' : 'dim'}>
        {agrees === null
          ? t('origin.evaluated')
          : agrees
            ? t('origin.agrees')
            : t('origin.differs', { fields: differences.join(', ') })}
      </p>
      <details>
        <summary>{t('origin.title')}</summary>
        <dl className="facts mono">
          {[
            [t('origin.saved'), dateTime(info.saved)],
            [t('origin.drive'), `${info.drive} · ${info.profile} · ${info.serial ?? '—'}`],
            [t('origin.program'), program || '—'],
            [t('origin.profile'), profile_version || '—'],
            ...flat(settings),
          ].map(([name, value]) => (
            <div key={name} className="pair">
              <dt>{name}</dt>
              <dd>{value}</dd>
            </div>
          ))}
        </dl>
      </details>
    </>
  )
}
