import { NativeSelect } from '@mantine/core'
import { useMemo, useState } from 'react'
import type { HealthRunInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { CurvesPlot } from '../../../plots/CurvesPlot'
import { dateTime, figure } from '../../../widgets/numbers/format'
import { useCurveColors } from '../tools/form/Answer'
import { type Series, seriesOf } from './health'

const UNITS: Record<Series['quantity'], string> = {
  resonance: 'Hz',
  antiresonance: 'Hz',
  friction: '%',
  inertia: 'kg·m²',
  step_rise: 's',
  step_overshoot: '%',
}
/** Rows of the table; the plot has all rounds. */
const SHOWN = 50

/** One quantity over the dates, as a plot and a table. */
export function HealthTrend({ runs }: { runs: HealthRunInfo[] }) {
  const t = useT()
  const [color] = useCurveColors()
  const series = useMemo(() => seriesOf(runs), [runs])
  const [chosen, setChosen] = useState('')
  const one = series.find((each) => each.name === chosen) ?? series[0]
  const curves = useMemo(
    () =>
      one
        ? [
            {
              label: one.name,
              color,
              points: true,
              x: one.time,
              y: one.value,
              low: one.low,
              high: one.high,
            },
          ]
        : [],
    [one, color],
  )
  if (!one) return null
  const nameOf = (each: Series) =>
    t(`health.${each.quantity}`) +
    (each.quantity === 'resonance' || each.quantity === 'antiresonance' ? ` ${each.number}` : '')
  const quantity = `${nameOf(one)} (${UNITS[one.quantity]})`
  const rows = one.time.map((time, index) => ({ time, index })).slice(-SHOWN)
  return (
    <>
      <NativeSelect
        label={t('health.trend')}
        value={one.name}
        onChange={(event) => setChosen(event.currentTarget.value)}
        data={series.map((each) => ({ value: each.name, label: nameOf(each) }))}
      />
      <CurvesPlot
        curves={curves}
        xLabel={t('health.date')}
        yLabel={quantity}
        label={t('health.over', { name: nameOf(one) })}
        dates
      />
      <div className="scroll-table">
        <table className="reported-values" aria-label={t('health.over', { name: nameOf(one) })}>
          <thead>
            <tr>
              <th>{t('health.date')}</th>
              <th className="right">{quantity}</th>
            </tr>
          </thead>
          <tbody className="num">
            {rows.reverse().map(({ time, index }) => (
              <tr key={index}>
                <td>{dateTime(new Date(time * 1000).toISOString())}</td>
                <td className="right">{figure(one.value[index] ?? null, 4)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  )
}
