import { Checkbox } from '@mantine/core'
import type { MessageInfo, ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import { Said } from '../messages/Said'
import { shown } from '../numbers/format'
import type { Raw } from './types'

/** What every comparison reports of a parameter, whichever sides it has. */
interface Compared {
  key: string
  name: string
  problem?: string | null
  problem_message?: MessageInfo | null
  unit: string
  motor_individual: boolean
}

/** One side of a comparison: its heading, and what it holds in a row. */
export interface Side<Row> {
  heading: string
  className?: string
  of: (row: Row) => [value: Raw | null, raw: Raw | null]
}

/** Parameters row by row, side by side, with a tick for each that can be written. */
export function ValueTable<Row extends Compared>({
  rows,
  sides,
  canTick,
  tickAll = false,
  ticked,
  onTick,
  mark,
  rowClass,
  parameters,
  className = '',
}: {
  rows: Row[]
  sides: Side<Row>[]
  canTick: (row: Row) => boolean
  /** Whether one box ticks all that can be. */
  tickAll?: boolean
  ticked: ReadonlySet<string>
  onTick: (keys: ReadonlySet<string>) => void
  /** How a row stands: the class of its mark, and its words. */
  mark: (row: Row) => [look: string, words: string]
  rowClass?: (row: Row) => string
  parameters: ParameterRow[]
  className?: string
}) {
  const t = useT()
  const info = new Map(parameters.map((row) => [row.key, row]))
  const toggle = (key: string) => {
    const next = new Set(ticked)
    if (!next.delete(key)) next.add(key)
    onTick(next)
  }
  const name = (row: Row) => info.get(row.key)?.name ?? row.name
  const text = (row: Row, [value, raw]: [Raw | null, Raw | null]) => {
    const parameter = info.get(row.key)
    return parameter ? shown(parameter, value, raw) : String(value ?? '—')
  }
  return (
    <div className={`scroll-table ${className}`}>
      <table>
        <thead>
          <tr>
            <th>
              {tickAll && <TickAll rows={rows.filter(canTick)} ticked={ticked} onTick={onTick} />}
            </th>
            <th>{t('column.key')}</th>
            <th>{t('column.name')}</th>
            {sides.map((side) => (
              <th key={side.heading} className={`right ${side.className ?? ''}`}>
                {side.heading}
              </th>
            ))}
            <th>{t('column.unit')}</th>
            <th>{t('column.marks')}</th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row) => (
            <tr key={row.key} className={rowClass?.(row)}>
              <td>
                <Checkbox
                  aria-label={t('compare.tick', { name: name(row) || row.key })}
                  disabled={!canTick(row)}
                  checked={ticked.has(row.key)}
                  onChange={() => toggle(row.key)}
                />
              </td>
              <td className="mono">{row.key}</td>
              <td>
                {name(row)}
                {row.problem && (
                  <small className="warn-text">
                    {' '}
                    <Said message={row.problem_message} words={row.problem} />
                  </small>
                )}
              </td>
              {sides.map((side) => (
                <td key={side.heading} className={`num right ${side.className ?? ''}`}>
                  {text(row, side.of(row))}
                </td>
              ))}
              <td className="unit">{row.unit}</td>
              <td>
                <span className={`mark ${mark(row)[0]}`}>{mark(row)[1]}</span>
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

function TickAll({
  rows,
  ticked,
  onTick,
}: {
  rows: Compared[]
  ticked: ReadonlySet<string>
  onTick: (keys: ReadonlySet<string>) => void
}) {
  const t = useT()
  const every = rows.length > 0 && rows.every((row) => ticked.has(row.key))
  return (
    <Checkbox
      aria-label={t('compare.tickAll')}
      checked={every}
      indeterminate={!every && ticked.size > 0}
      onChange={() => onTick(every ? new Set() : new Set(rows.map((row) => row.key)))}
    />
  )
}
