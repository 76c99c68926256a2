import { Checkbox, NativeSelect } from '@mantine/core'
import { useMemo, useState } from 'react'
import { useT } from '../../../i18n'
import { type WindowKind, WINDOWS } from '../../../live/scope/analysis/spectrum'
import { LinesPlot } from '../../../plots/LinesPlot'
import { figure } from '../../../widgets/numbers/format'
import type { PanelProps } from '../panels'
import { TracePicker } from './TracePicker'
import { useAnalysis } from './useAnalysis'

/** Amplitudes of the sines in one trace, over the stretch between the cursors or in sight. */
export function SpectrumPanel({ shown, colors, stretch, running, change, dark }: PanelProps) {
  const t = useT()
  const [chosen, setChosen] = useState('')
  const [window_, setWindow] = useState<WindowKind>('hann')
  const [decibels, setDecibels] = useState(false)
  const [logarithmic, setLogarithmic] = useState(false)
  const place = Math.max(
    0,
    shown.findIndex((each) => each.id === chosen),
  )
  const trace = shown[place]
  const found = useAnalysis(
    'spectrum',
    () => {
      const over = stretch()
      if (!trace || !over) return null
      return { ...over, id: trace.id, window: window_, synchronous: trace.synchronous === true }
    },
    running,
    JSON.stringify([trace?.id, trace?.unit, window_, change]),
  )
  const y = useMemo(
    () =>
      found &&
      (decibels
        ? found.amplitude.map((a) => 20 * Math.log10(Math.max(a, 1e-12)))
        : found.amplitude),
    [found, decibels],
  )
  if (!trace) return null
  const unit = decibels ? `dB (1 ${trace.unit})` : trace.unit
  return (
    <section aria-label={t('scope.tab.spectrum')}>
      <div className="row wrap">
        <TracePicker shown={shown} value={trace.id} onChange={setChosen} />
        <NativeSelect
          label={t('spectrum.window')}
          value={window_}
          onChange={(event) => setWindow(event.currentTarget.value as WindowKind)}
          data={WINDOWS.map((each) => ({ value: each, label: t(`spectrum.${each}`) }))}
        />
        <Checkbox
          label={t('spectrum.decibels')}
          checked={decibels}
          onChange={(event) => setDecibels(event.currentTarget.checked)}
        />
        <Checkbox
          label={t('spectrum.logarithmic')}
          checked={logarithmic}
          onChange={(event) => setLogarithmic(event.currentTarget.checked)}
        />
      </div>
      {found === null || y === null ? (
        <p className="dim">{t('spectrum.few')}</p>
      ) : (
        <>
          <LinesPlot
            x={found.frequency}
            y={y}
            xLabel={t('spectrum.frequency')}
            yLabel={unit}
            label={trace.label}
            color={colors[place] as string}
            dark={dark}
            logarithmic={logarithmic}
          />
          <p className="dim num">
            {t('spectrum.facts', {
              samples: found.samples,
              rate: figure(found.sampleRate, 5),
              resolution: figure(found.resolution, 3),
            })}{' '}
            {found.resampled && <strong className="warn-text">{t('spectrum.resampled')}</strong>}
          </p>
          <table className="peaks" aria-label={t('spectrum.peaks')}>
            <thead>
              <tr>
                <th className="right">{t('spectrum.frequency')}</th>
                <th className="right">{t('spectrum.amplitude', { unit: trace.unit })}</th>
              </tr>
            </thead>
            <tbody>
              {found.peaks.slice(0, 5).map((peak, i) => (
                <tr key={i}>
                  <td className="num right">{figure(peak.frequency, 5)}</td>
                  <td className="num right">{figure(peak.amplitude, 4)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </>
      )}
    </section>
  )
}
