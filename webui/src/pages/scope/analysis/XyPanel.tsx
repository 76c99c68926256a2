import { useState } from 'react'
import { useT } from '../../../i18n'
import { XyPlot } from '../../../plots/XyPlot'
import type { PanelProps } from '../panels'
import { TracePicker } from './TracePicker'
import { useAnalysis } from './useAnalysis'

const MOST_POINTS = 8000

/** One trace over another, at the times of the one upwards. */
export function XyPanel({ shown, colors, stretch, running, change, dark }: PanelProps) {
  const t = useT()
  const [across, setAcross] = useState('')
  const [up, setUp] = useState('')
  const x = shown.find((each) => each.id === across) ?? shown[0]
  const place = shown.findIndex((each) => each.id === up)
  const y = shown[place] ?? shown[1] ?? shown[0]
  const found = useAnalysis(
    'xy',
    () => {
      const over = stretch()
      return x && y && over ? { ...over, x: x.id, y: y.id, most: MOST_POINTS } : null
    },
    running,
    JSON.stringify([x?.id, x?.unit, y?.id, y?.unit, change]),
  )
  if (!x || !y) return null
  return (
    <section aria-label={t('scope.tab.xy')}>
      <div className="row wrap">
        <TracePicker label={t('xy.across')} shown={shown} value={x.id} onChange={setAcross} />
        <TracePicker label={t('xy.up')} shown={shown} value={y.id} onChange={setUp} />
      </div>
      <XyPlot
        x={found?.x ?? []}
        y={found?.y ?? []}
        times={found?.times ?? []}
        xLabel={`${x.label} [${x.unit}]`}
        yLabel={`${y.label} [${y.unit}]`}
        label={t('scope.tab.xy')}
        color={colors[shown.indexOf(y)] as string}
        dark={dark}
      />
    </section>
  )
}
