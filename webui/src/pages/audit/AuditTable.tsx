import type { AuditEvent } from '../../api/schema'
import { known, useSay, useT } from '../../i18n'
import type { Say } from '../../i18n'
import { dateTime } from '../../widgets/numbers/format'

/** Entries as rows; on a narrow screen each becomes a card. */
export function AuditTable({ events }: { events: AuditEvent[] }) {
  const t = useT()
  const say = useSay()
  return (
    <table className="audit-table">
      <thead>
        <tr>
          <th>{t('audit.time')}</th>
          <th>{t('audit.person')}</th>
          <th>{t('audit.axis')}</th>
          <th>{t('audit.what')}</th>
          <th>{t('audit.change')}</th>
          <th>{t('audit.outcome')}</th>
        </tr>
      </thead>
      <tbody>
        {events.map((event) => (
          <tr key={event.number}>
            <td className="num" title={`#${event.number}`}>
              {dateTime(event.time)}
            </td>
            <td>{event.person}</td>
            <td>{event.axis}</td>
            <td>
              <strong>{known(t, 'audit.kind', event.kind)}</strong>{' '}
              {known(t, 'audit.action', event.action)} {whatOf(event, say)}
            </td>
            <td className="num">{changeOf(event)}</td>
            <td className={event.outcome ? 'warn-text' : 'dim'}>
              {say.message(event.outcome_message, event.outcome) || t('audit.ok')}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  )
}

/** What it was done to: a parameter with its name, a job's title, a file. */
export function whatOf(event: AuditEvent, say: Say): string {
  const { parameter, version } = event.detail
  if (event.title_message) return say.message(event.title_message)
  if (typeof parameter === 'string') return `${event.target} ${parameter}`
  return typeof version === 'number' ? `${event.target} · ${version}` : event.target
}

/** Raw values before and after; what was wanted where that is not what the drive has now. */
export function changeOf(event: AuditEvent): string {
  const { old, new: now } = event
  const wanted = event.detail.wanted ?? null
  if (old === null && now === null && wanted === null) return ''
  const text = `${old ?? '?'} → ${now ?? '?'}`
  return wanted === null ? text : `${text} (${wanted})`
}
