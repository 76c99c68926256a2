import type { HandoverConflict } from '../../../api/schema'
import { useT } from '../../../i18n'

const MARKS: Record<HandoverConflict['consequence'], string> = {
  gain: 'differs',
  limit: 'refused',
  unit: 'refused',
  motion: 'refused',
  other: 'quiet',
}

/** Three sides of each conflict, its consequence, and with `says` a sentence of what happens. */
export function ConflictTable({
  rows,
  controller,
  says = false,
}: {
  rows: HandoverConflict[]
  /** Heading of the controller's side; empty leaves it out. */
  controller: string
  says?: boolean
}) {
  const t = useT()
  const text = (value: HandoverConflict['ours_value']) => (value === null ? '—' : String(value))
  return (
    <div className="scroll-table">
      <table>
        <thead>
          <tr>
            <th>{t('handover.column.consequence')}</th>
            <th>{t('column.key')}</th>
            <th>{t('column.name')}</th>
            <th className="right">
              {t(controller ? 'handover.column.ours' : 'handover.column.handed')}
            </th>
            <th className="right">{t('handover.column.drive')}</th>
            {controller && <th className="right">{controller}</th>}
            <th>{t('column.unit')}</th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => (
            <tr key={row.key}>
              <td>
                <span className={`mark ${MARKS[row.consequence]}`}>
                  {t(`handover.consequence.${row.consequence}`)}
                </span>
              </td>
              <td className="mono">{row.key}</td>
              <td>
                {row.name}
                {says && (
                  <small className="warn-text handover-says">
                    {t(`handover.says.${row.consequence}`, { name: row.name })}
                  </small>
                )}
              </td>
              <td className="num right">{text(row.ours_value)}</td>
              <td className="num right">{text(row.drive_value)}</td>
              {controller && <td className="num right">{text(row.controller_value)}</td>}
              <td className="unit">{row.unit}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}
