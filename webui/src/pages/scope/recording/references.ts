import { useCallback, useState } from 'react'
import { thinned } from '../../../live/scope/decimate'
import type { Overlay } from '../../../live/worker/worker-messages'
import type { PlotOverlay } from '../../../plots/TimePlot'
import type { Shown } from '../setup/setup'

/** A curve that stays in sight for comparison; times from what was shown as zero. */
export interface Reference {
  label: string
  unit: string
  times: Float64Array
  values: Float64Array
}

const MOST_POINTS = 4000
let kept: Reference[] = []

/** References stay when another page is opened: the motion to compare is started there. */
export function useReferences(): [Reference[], (references: Reference[]) => void] {
  const [references, setReferences] = useState(kept)
  const change = useCallback((next: Reference[]) => {
    kept = next
    setReferences(next)
  }, [])
  return [references, change]
}

/** References as the plot draws them; every raw sample stays in the reference itself. */
export function referenceOverlays(references: Reference[], colors: string[]): PlotOverlay[] {
  return references.map(({ unit, times, values }, i) => ({
    unit,
    color: colors[(i + 3) % colors.length] as string,
    dashed: true,
    ...thinned(times, values, MOST_POINTS),
  }))
}

/** Earlier sweeps, the older the fainter. */
export function sweepOverlays(
  overlays: Overlay[],
  shown: Shown[],
  colors: string[],
): PlotOverlay[] {
  return overlays.map((overlay, i) => ({
    unit: shown[overlay.trace]?.unit ?? '',
    color: colors[overlay.trace] as string,
    dashed: false,
    opacity: 0.15 + (0.35 * (i + 1)) / overlays.length,
    times: overlay.times,
    values: overlay.values,
  }))
}
