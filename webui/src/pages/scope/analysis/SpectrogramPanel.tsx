import { useMemo, useState } from 'react'
import { useT } from '../../../i18n'
import { HeatMap } from '../../../plots/HeatMap'
import type { PanelProps } from '../panels'
import { TracePicker } from './TracePicker'
import { useAnalysis } from './useAnalysis'

const COLUMNS = 240

/** How the spectrum of one trace changes over the stretch. */
export function SpectrogramPanel({ shown, stretch, running, change, dark }: PanelProps) {
  const t = useT()
  const [chosen, setChosen] = useState('')
  const trace = shown.find((each) => each.id === chosen) ?? shown[0]
  const found = useAnalysis(
    'spectrogram',
    () => {
      const over = stretch()
      if (!trace || !over) return null
      return { ...over, id: trace.id, columns: COLUMNS, synchronous: trace.synchronous === true }
    },
    running,
    JSON.stringify([trace?.id, trace?.unit, change]),
  )
  const now = stretch()?.origin ?? 0
  // While the picture runs, what counts as zero runs on before the next answer is there.
  const { times, origin } = useMemo(
    () => ({ times: found ? Array.from(found.times, (time) => time - now) : [], origin: now }),
    [found],
  )
  if (!trace) return null
  return (
    <section aria-label={t('scope.tab.spectrogram')}>
      <div className="row wrap">
        <TracePicker shown={shown} value={trace.id} onChange={setChosen} />
        {found?.resampled && <strong className="warn-text">{t('spectrum.resampled')}</strong>}
      </div>
      {found === null ? (
        <p className="dim">{t('spectrum.few')}</p>
      ) : (
        <HeatMap
          times={times}
          origin={origin}
          rows={found.frequency.length}
          values={found.amplitude}
          highest={found.frequency.at(-1) ?? 1}
          unit={trace.unit}
          label={t('scope.tab.spectrogram')}
          timeLabel={t('scope.time')}
          valueLabel={t('spectrum.frequency')}
          dark={dark}
        />
      )}
    </section>
  )
}
