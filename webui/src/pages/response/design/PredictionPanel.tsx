import { SegmentedControl } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import type { GainInfo, NotchSlotInfo, PredictionInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import type { Curve } from '../plot/bode'
import { BodePlot } from '../plot/BodePlot'
import { GainFields, type PartialGains, whole } from './GainFields'
import { Legend } from '../plot/Legend'
import { MarginList } from '../plot/Readings'
import type { NotchShape } from '../results'
import { StepPlot } from '../plot/StepPlot'
import { usable } from './useGains'
import { usePrediction } from './usePrediction'

const VIEWS = ['closed', 'open', 'sensitivity', 'step'] as const
type View = (typeof VIEWS)[number]

/**
 * The speed loop as it would be with the notches and gains tried here, compared with the loop as it
 * is.
 */
export function PredictionPanel({
  drive,
  file,
  info,
  slots,
  wanted,
  colors,
  dark,
}: {
  drive: string
  file: string
  info: GainInfo
  slots: NotchSlotInfo[]
  wanted: (NotchShape | null)[]
  colors: string[]
  dark: boolean
}) {
  const t = useT()
  const start = usable(info)
  const [tried, setTried] = useState<PartialGains | null>(start)
  const [view, setView] = useState<View>('closed')
  const key = JSON.stringify(start)
  useEffect(() => setTried(start), [key])
  const acting = slots.map((slot) => (slot.enabled ? slot.notch : null))
  const now = usePrediction(drive, file, acting, start)
  const next = usePrediction(drive, file, wanted, tried ? whole(tried) : null)
  const both = useMemo(
    () =>
      [
        { label: t('predict.now'), color: colors[1] ?? '', dashed: true, found: now.found },
        { label: t('predict.tried'), color: colors[0] ?? '', dashed: false, found: next.found },
      ].flatMap(({ found, ...look }) => (found ? [{ ...look, found }] : [])),
    [now.found, next.found, colors.join(), t('predict.now')],
  )
  const curves = useMemo(() => both.map((each) => curveOf(each, view)), [both, view])
  const traces = useMemo(
    () => both.map((each) => ({ ...each, time: each.found.step_time_s, value: each.found.step })),
    [both],
  )
  if (!tried) return null
  const frequency = next.found?.frequency_hz ?? now.found?.frequency_hz ?? [1, 1000]
  return (
    <Panel title={t('predict.title')}>
      <p className="dim">{t('predict.help')}</p>
      <GainFields gains={tried} onChange={setTried} />
      <SegmentedControl
        fullWidth
        value={view}
        onChange={(each) => setView(each)}
        data={VIEWS.map((each) => ({ value: each, label: t(`predict.${each}`) }))}
      />
      <ProblemNote problem={next.problem} />
      {both.length > 0 && (
        <>
          <Legend of={both} />
          {view === 'step' ? (
            <StepPlot
              shared="predicted_step"
              traces={traces}
              unit=""
              label={t('predict.step')}
              timeLabel={t('predict.time')}
              dark={dark}
            />
          ) : (
            <BodePlot
              shared="prediction"
              curves={curves}
              markers={[]}
              band={null}
              shown={[Math.max(1, frequency[0] ?? 1), frequency.at(-1) ?? 1000]}
              unit="1"
              label={t(`predict.${view}`)}
              dark={dark}
              onMarker={() => {}}
            />
          )}
        </>
      )}
      {next.found && <MarginList margins={next.found.margins} />}
    </Panel>
  )
}

function curveOf(
  each: { label: string; color: string; dashed: boolean; found: PredictionInfo },
  view: View,
): Curve {
  const { found } = each
  const open = view === 'open'
  return {
    ...each,
    frequency: found.frequency_hz,
    magnitude:
      view === 'sensitivity' ? found.sensitivity_db : open ? found.open_db : found.closed_db,
    phase:
      view === 'sensitivity'
        ? found.frequency_hz.map(() => null)
        : open
          ? found.open_deg
          : found.closed_deg,
  }
}
