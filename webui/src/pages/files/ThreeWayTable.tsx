import { Checkbox } from '@mantine/core'
import type { ParameterRow, ThreeWayRow } from '../../api/schema'
import { useT } from '../../i18n'
import { shown } from '../../widgets/format'
import type { Raw } from '../../widgets/types'

/** Rows whose value in the set differs from the drive's can be written there. */
const canTick = (row: ThreeWayRow) =>
  row.status === 'theirs' || row.status === 'drive' || row.status === 'conflict'

/** Row by row: base, set and drive, and who changed what. */
export function ThreeWayTable({
  rows,
  ticked,
  onTick,
  parameters,
}: {
  rows: ThreeWayRow[]
  ticked: ReadonlySet<string>
  onTick: (keys: ReadonlySet<string>) => void
  parameters: ParameterRow[]
}) {
  const t = useT()
  const info = new Map(parameters.map((row) => [row.key, row]))
  const toggle = (key: string) => {
    const next = new Set(ticked)
    if (!next.delete(key)) next.add(key)
    onTick(next)
  }
  const text = (row: ThreeWayRow, value: Raw | null, raw: Raw | null) => {
    const parameter = info.get(row.key)
    return parameter ? shown(parameter, value, raw) : String(value ?? '—')
  }
  return (
    <div className="scroll-table three-way">
      <table>
        <thead>
          <tr>
            <th />
            <th>{t('column.key')}</th>
            <th>{t('column.name')}</th>
            <th className="right">{t('three.column.base')}</th>
            <th className="right">{t('three.column.theirs')}</th>
            <th className="right">{t('compare.drive')}</th>
            <th>{t('column.unit')}</th>
            <th>{t('column.marks')}</th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => (
            <tr key={row.key}>
              <td>
                <Checkbox
                  aria-label={t('compare.tick', { name: row.name || row.key })}
                  disabled={!canTick(row)}
                  checked={ticked.has(row.key)}
                  onChange={() => toggle(row.key)}
                />
              </td>
              <td className="mono">{row.key}</td>
              <td>
                {row.name}
                {row.problem && <small className="warn-text"> {row.problem}</small>}
              </td>
              <td className="num right">{text(row, row.base_value, row.base_raw)}</td>
              <td className="num right">{text(row, row.theirs_value, row.theirs_raw)}</td>
              <td className="num right">{text(row, row.drive_value, row.drive_raw)}</td>
              <td className="unit">{row.unit}</td>
              <td>
                <span className={`mark ${MARKS[row.status]}`}>
                  {t(`three.status.${row.status}`)}
                </span>
                {row.motor_individual && (
                  <span className="mark quiet">{t('parameters.individual')}</span>
                )}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      {rows.length === 0 && <p className="empty">{t('compare.none')}</p>}
    </div>
  )
}

const MARKS: Record<ThreeWayRow['status'], string> = {
  same: 'quiet',
  both: 'quiet',
  theirs: 'differs',
  drive: 'edited',
  conflict: 'refused',
  not_in_theirs: 'quiet',
  not_in_drive: 'refused',
  invalid: 'refused',
  read_only: 'quiet',
}
