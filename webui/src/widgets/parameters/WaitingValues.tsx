import type { ParameterValue } from '../../api/schema'
import { useT } from '../../i18n'
import { useReadings } from '../../live/store'
import { shown } from '../numbers/format'
import { useRows } from '../profile-text/rows'

/** Procedures after which values act or are kept, and the values that wait for that. */
const WAITING: Record<string, (now: ParameterValue) => boolean> = {
  write_settings: (now) => now.pending === 'write_settings',
  save: (now) => now.unsaved,
}

/** Exactly which values a procedure makes act, or stores, and why that is safe. */
export function WaitingValues({ drive, procedure }: { drive: string; procedure: string }) {
  const t = useT()
  const rows = useRows(drive) ?? []
  const readings = useReadings(drive)
  const waits = WAITING[procedure]
  if (!waits) return null
  const name = procedure as 'write_settings' | 'save'
  const values = rows
    .map((row) => ({ row, now: readings?.get(row.key) ?? row.reading }))
    .filter(({ now }) => waits(now))
  if (values.length === 0) return <p>{t(`procedures.none.${name}`)}</p>
  return (
    <>
      <p>{t(`procedures.which.${name}`, { count: values.length })}</p>
      <dl className="facts scroll-list">
        {values.map(({ row, now }) => (
          <div key={row.key} className="pair">
            <dt>
              <span className="mono dim">{row.number ?? row.key}</span> {row.name}
            </dt>
            <dd className="num">
              {shown(row, now.value, now.raw)} {row.unit}
            </dd>
          </div>
        ))}
      </dl>
      <p>{t(`procedures.safe.${name}`)}</p>
    </>
  )
}
