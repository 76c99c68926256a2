import type { Quality } from '../../api/schema'
import { useT } from '../../i18n'

const COUNTERS = [
  'transactions',
  'timeouts',
  'crc_errors',
  'framing_errors',
  'retries',
  'lost_frames',
  'wkc_errors',
] as const

/** Counters of a link since it was opened; what is wrong stands out. */
export function QualityTable({ quality }: { quality: Quality }) {
  const t = useT()
  return (
    <dl className="counters">
      <div>
        <dt>{t('quality.state')}</dt>
        <dd>{quality.state}</dd>
      </div>
      {COUNTERS.map((name) => (
        <div key={name} className={name !== 'transactions' && quality[name] > 0 ? 'warn-text' : ''}>
          <dt>{t(`quality.${name}`)}</dt>
          <dd className="num">{quality[name]}</dd>
        </div>
      ))}
      <div>
        <dt>{t('quality.round_trip')}</dt>
        <dd className="num">
          {quality.round_trip_ms === null ? '—' : `${quality.round_trip_ms.toFixed(2)} ms`}
        </dd>
      </div>
      {Object.entries(quality.details).map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd className="num">{value}</dd>
        </div>
      ))}
    </dl>
  )
}
