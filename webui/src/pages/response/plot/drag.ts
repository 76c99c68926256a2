import type uPlot from 'uplot'
import type { Marker } from './BodePlot'

const GRAB_PX = 22
/** A finger that went no farther sideways taps; one that goes up or down scrolls the page. */
const TAP_PX = 6

/** What a pointer took hold of. `moves`: it is certain that it is to be moved. */
interface Grip {
  id: string
  away: number
  x: number
  moves: boolean
}

/**
 * Dragging takes the nearest marker; a press far from any brings the nearest cursor there. Only one
 * finger and the main button drag; a finger that scrolls the page moves nothing.
 */
export function dragMarkers(
  plot: uPlot,
  markers: () => Marker[],
  move: (id: string, frequency: number) => void,
): () => void {
  const { over } = plot
  let grip: Grip | null = null
  const left = (event: PointerEvent) => event.clientX - over.getBoundingClientRect().left
  const at = (event: PointerEvent) =>
    plot.posToVal(Math.min(Math.max(left(event), 0), over.clientWidth), 'x')
  const down = (event: PointerEvent) => {
    grip = null
    if (!event.isPrimary || event.button !== 0) return
    const x = left(event)
    const places = markers().map((each) => ({
      id: each.id,
      away: Math.abs(plot.valToPos(each.frequency, 'x') - x),
    }))
    const found = grabbed(places)
    if (!found) return
    grip = { ...found, x, moves: event.pointerType !== 'touch' }
    over.setPointerCapture(event.pointerId)
    if (grip.moves && grip.away > GRAB_PX) move(grip.id, at(event))
  }
  const drag = (event: PointerEvent) => {
    if (!grip || !event.isPrimary) return
    grip.moves ||= Math.abs(left(event) - grip.x) > TAP_PX
    if (grip.moves) move(grip.id, at(event))
  }
  const up = (event: PointerEvent) => {
    if (!event.isPrimary) return
    if (grip && !grip.moves && grip.away > GRAB_PX) move(grip.id, at(event))
    grip = null
  }
  const drop = () => (grip = null)
  over.addEventListener('pointerdown', down)
  over.addEventListener('pointermove', drag)
  over.addEventListener('pointerup', up)
  over.addEventListener('pointercancel', drop)
  return () => {
    over.removeEventListener('pointerdown', down)
    over.removeEventListener('pointermove', drag)
    over.removeEventListener('pointerup', up)
    over.removeEventListener('pointercancel', drop)
  }
}

/** What a press takes hold of; where a cursor lies on a notch, the notch is what is meant. */
export function grabbed(
  places: { id: string; away: number }[],
): { id: string; away: number } | null {
  const near = places.toSorted((a, b) => a.away - b.away)
  const within = near.filter((each) => each.away <= GRAB_PX)
  return (
    within.find((each) => each.id.startsWith('notch')) ??
    within[0] ??
    near.find((each) => each.id.startsWith('cursor')) ??
    null
  )
}
