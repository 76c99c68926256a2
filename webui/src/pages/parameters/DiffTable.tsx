import { Checkbox } from '@mantine/core'
import type { DiffRow, ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import { shown } from '../../widgets/format'
import type { Raw } from '../../widgets/types'

const canTick = (row: DiffRow) => row.status === 'differs' && row.file_raw !== null

/** Row by row: what the file (or the other side) says, what the drive says, the default. */
export function DiffTable({
  rows,
  ticked,
  onTick,
  parameters,
}: {
  rows: DiffRow[]
  ticked: ReadonlySet<string>
  onTick: (keys: ReadonlySet<string>) => void
  parameters: ParameterRow[]
}) {
  const t = useT()
  const info = new Map(parameters.map((row) => [row.key, row]))
  const possible = rows.filter(canTick)
  const every = possible.length > 0 && possible.every((row) => ticked.has(row.key))
  const toggle = (key: string) => {
    const next = new Set(ticked)
    if (!next.delete(key)) next.add(key)
    onTick(next)
  }
  const text = (row: DiffRow, value: Raw | null, raw: Raw | null) => {
    const parameter = info.get(row.key)
    return parameter ? shown(parameter, value, raw) : String(value ?? '—')
  }
  return (
    <div className="scroll-table">
      <table>
        <thead>
          <tr>
            <th>
              <Checkbox
                aria-label={t('compare.tickAll')}
                checked={every}
                indeterminate={!every && ticked.size > 0}
                onChange={() => onTick(every ? new Set() : new Set(possible.map((row) => row.key)))}
              />
            </th>
            <th>{t('column.key')}</th>
            <th>{t('column.name')}</th>
            <th className="right">{t('compare.theirs')}</th>
            <th className="right">{t('compare.drive')}</th>
            <th className="right wide-only">{t('column.default')}</th>
            <th>{t('column.unit')}</th>
            <th>{t('column.marks')}</th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => (
            <tr key={row.key} className={`diff-${row.status}`}>
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
              <td className="num right">{text(row, row.file_value, row.file_raw)}</td>
              <td className="num right">{text(row, row.drive_value, row.drive_raw)}</td>
              <td className="num right wide-only dim">
                {text(row, row.default_value, row.default_raw)}
              </td>
              <td className="unit">{row.unit}</td>
              <td>
                <span className={`mark ${MARKS[row.status]}`}>{t(`diff.${row.status}`)}</span>
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

const MARKS: Record<DiffRow['status'], string> = {
  differs: 'differs',
  same: 'quiet',
  not_in_drive: 'refused',
  not_in_file: 'quiet',
  invalid: 'refused',
  read_only: 'quiet',
}
