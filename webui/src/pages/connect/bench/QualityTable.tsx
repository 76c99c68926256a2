import type { Quality } from '../../../api/schema'
import { known, useT } from '../../../i18n'
import { Said } from '../../../widgets/messages/Said'
import { figures } from './figures'

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
        <dd>
          {quality.state ? (
            <Said message={quality.state_message} words={quality.state} />
          ) : (
            t(quality.connected ? 'quality.is.open' : 'quality.is.not open')
          )}
        </dd>
      </div>
      {COUNTERS.map((name) => (
        <div key={name} className={name !== 'transactions' && quality[name] > 0 ? 'warn-text' : ''}>
          <dt>{t(`quality.${name}`)}</dt>
          <dd className="num">{quality[name]}</dd>
        </div>
      ))}
      {quality.round_trip_ms !== null && (
        <div>
          <dt>{t('quality.round_trip')}</dt>
          <dd className="num">{quality.round_trip_ms.toFixed(2)} ms</dd>
        </div>
      )}
      {figures(quality.details).map(({ name, words, value, unit }) => (
        <div key={name}>
          <dt>{name in NAMED ? t(NAMED[name as keyof typeof NAMED]) : words}</dt>
          <dd className="num">
            {known(t, 'quality.is', value)} {unit}
          </dd>
        </div>
      ))}
    </dl>
  )
}

/** What only some links count. */
const NAMED = {
  baudrate: 'quality.baudrate',
  parity: 'quality.parity',
  echo: 'quality.echo',
  losses: 'quality.losses',
  refusals: 'quality.refusals',
  held_back_ms: 'quality.heldBack',
  late_checks: 'quality.lateChecks',
  late_answers: 'quality.lateAnswers',
  stray_answers: 'quality.strayAnswers',
  host_restarts: 'quality.hostRestarts',
  late_frames: 'quality.lateFrames',
  frames_received: 'quality.framesReceived',
  frames_sent: 'quality.framesSent',
  error_frames: 'quality.errorFrames',
  bus_offs: 'quality.busOffs',
  reopened: 'quality.reopened',
  boots: 'quality.boots',
  emergencies: 'quality.emergencies',
  cycles: 'quality.cycles',
  skipped_cycles: 'quality.skippedCycles',
  incomplete_samples: 'quality.incompleteSamples',
  sync_late_p50_us: 'quality.syncLate50',
  sync_late_p99_us: 'quality.syncLate99',
  sync_late_max_us: 'quality.syncLateMax',
  cyclic_bus_load_percent: 'quality.busLoad',
} as const
