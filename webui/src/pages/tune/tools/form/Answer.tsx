import { useComputedColorScheme } from '@mantine/core'
import { useT } from '../../../../i18n'
import type { ShownNote, ShownRow, ShownTable } from './shown'
import { amount, interval } from '../../steps/steps'

const COLORS = {
  light: ['#1a5c94', '#c2571a', '#2e7d32', '#7b3fa0'],
  dark: ['#6db3f2', '#f0a060', '#7fd08a', '#c79bea'],
} as const

/** Colours of the curves of an answer, in their order. */
export const useCurveColors = (): readonly [string, string, string, string] =>
  COLORS[useComputedColorScheme('light') === 'dark' ? 'dark' : 'light']

/** Verdict and findings, one note each. */
export function Notes({ notes }: { notes: ShownNote[] }) {
  return notes.map((each) => (
    <p key={each.words} className={`note ${each.tone}`}>
      {each.words}
    </p>
  ))
}

/** Figures with their units and intervals; nothing where there are none. */
export function ValuesTable({
  rows,
  label,
  unknown,
}: {
  rows: ShownRow[]
  label: string
  /** Stands where a value is not known; a dash if not stated. */
  unknown?: string
}) {
  const t = useT()
  if (rows.length === 0) return null
  return (
    <div className="scroll-table">
      <table className="reported-values" aria-label={label}>
        <thead>
          <tr>
            <th>{t('inertia.quantity')}</th>
            <th className="right">{t('inertia.value')}</th>
          </tr>
        </thead>
        <tbody className="num">
          {rows.map(({ name, value, unit, ends }) => (
            <tr key={`${name} ${unit} ${value}`}>
              <td>{name}</td>
              <td className="right">
                {value === null ? (unknown ?? amount(null, '')) : amount(value, unit)}
                {ends !== undefined && <small className="dim interval">{interval(ends)}</small>}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}

/** Lists of an answer, such as shapers or speeds to avoid. */
export function ListTables({ tables }: { tables: ShownTable[] }) {
  return tables.map((table) => (
    <div className="scroll-table" key={table.name}>
      <table className="reported-values of-lists" aria-label={table.name}>
        <thead>
          <tr>
            {table.head.map((each) => (
              <th key={each}>{each}</th>
            ))}
          </tr>
        </thead>
        <tbody className="num">
          {table.rows.map((row) => (
            <tr key={row.slice(0, 2).join()}>
              {row.map((cell, place) => (
                <td key={table.head[place]}>{cell}</td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  ))
}
