import type { KeyboardEvent } from 'react'
import { useT } from '../../../i18n'
import { hertz } from './bode'
import type { Marker } from './BodePlot'

/** One step of an arrow key; with Shift a tenth of it, with the page keys ten times as much. */
const STEP = 1.01
const FINE = 1.001
const COARSE = 1.1

/** Where a key brings a frequency within a range; null for keys that move nothing. */
export function moved(
  key: string,
  fine: boolean,
  frequency: number,
  [low, high]: [number, number],
): number | null {
  if (key === 'Home') return low
  if (key === 'End') return high
  const factor = factorOf(key, fine)
  return factor === null ? null : Math.min(Math.max(frequency * factor, low), high)
}

function factorOf(key: string, fine: boolean): number | null {
  const step = fine ? FINE : STEP
  if (key === 'ArrowRight' || key === 'ArrowUp') return step
  if (key === 'ArrowLeft' || key === 'ArrowDown') return 1 / step
  if (key === 'PageUp') return COARSE
  if (key === 'PageDown') return 1 / COARSE
  return null
}

/** The markers of a plot as sliders, for those who use no mouse. */
export function MarkerChips({
  markers,
  range,
  onMove,
}: {
  markers: Marker[]
  range: [number, number]
  onMove: (id: string, frequency: number) => void
}) {
  const t = useT()
  const press = (marker: Marker) => (event: KeyboardEvent) => {
    const to = moved(event.key, event.shiftKey, marker.frequency, range)
    if (to === null) return
    event.preventDefault()
    onMove(marker.id, to)
  }
  return (
    <div className="markers" role="group" aria-label={t('marker.group')}>
      {markers.map((marker) => (
        <span
          key={marker.id}
          className="marker num"
          role="slider"
          tabIndex={0}
          aria-label={
            marker.id.startsWith('notch')
              ? t('notch.slot', { number: marker.label.slice(1) })
              : t('marker.cursor', { name: marker.label })
          }
          aria-orientation="horizontal"
          aria-valuemin={Math.round(range[0])}
          aria-valuemax={Math.round(range[1])}
          aria-valuenow={Number(marker.frequency.toPrecision(4))}
          aria-valuetext={hertz(marker.frequency)}
          onKeyDown={press(marker)}
        >
          {marker.label} {hertz(marker.frequency)}
        </span>
      ))}
      <small className="dim">{t('marker.keys')}</small>
    </div>
  )
}
