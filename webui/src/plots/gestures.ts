import type uPlot from 'uplot'
import { moved, type Span, wheelFactor, zoomed } from './yscale'

/** What a hand on the plot asks for. Times are of the traces, not of the shown zero. */
export interface PlotEvents {
  onStretch: (from: number, to: number) => void
  onFollow: () => void
  onCursor: (index: number, time: number) => void
  /** A y scale of the person's choice; null lets it follow the traces again. */
  onRange: (unit: string, range: Span | null) => void
}

interface Picture {
  from: number
  to: number
  origin: number
  cursors: number[]
}

type Events = { current: PlotEvents }
type Stop = () => void

const GRAB_PX = 14
/** Fingers nearer to each other than this in one direction do not zoom in it. */
const PINCH_PX = 40

/** Wheel, cursors and fingers on the plot, wheel and drag on its y axes. */
export function listen(plot: uPlot, picture: () => Picture | null, events: Events): Stop {
  const stops = [
    wheelAndCursors(plot, picture, events),
    pinch(plot, picture, events),
    ...yAxes(plot).map(({ unit, element }) => onAxis(plot, unit, element, events)),
  ]
  return () => {
    for (const stop of stops) stop()
  }
}

/** The y axes as uPlot has laid them out: x first, then one for each unit. */
function yAxes(plot: uPlot): { unit: string; element: HTMLElement }[] {
  const elements = [...plot.root.querySelectorAll<HTMLElement>('.u-axis')].slice(1)
  return elements.flatMap((element, i) => {
    const unit = plot.axes[i + 1]?.scale
    return unit === undefined ? [] : [{ unit, element }]
  })
}

function spanOf(plot: uPlot, unit: string): Span | null {
  const { min, max } = plot.scales[unit] ?? {}
  return typeof min === 'number' && typeof max === 'number' ? { min, max } : null
}

function heard<Kind extends keyof HTMLElementEventMap>(
  element: HTMLElement,
  kind: Kind,
  act: (event: HTMLElementEventMap[Kind]) => void,
): Stop {
  element.addEventListener(kind, act, { passive: false })
  return () => element.removeEventListener(kind, act)
}

const all =
  (...stops: Stop[]): Stop =>
  () => {
    for (const stop of stops) stop()
  }

function zoomY(plot: uPlot, unit: string, y: number, factor: number, events: Events): void {
  const span = spanOf(plot, unit)
  if (span) events.current.onRange(unit, zoomed(span, plot.posToVal(y, unit), factor))
}

function wheelAndCursors(plot: uPlot, picture: () => Picture | null, events: Events): Stop {
  let dragged: number | null = null
  const place = (event: MouseEvent) => {
    const box = plot.over.getBoundingClientRect()
    return { x: event.clientX - box.left, y: event.clientY - box.top }
  }
  const timeAt = (x: number) => plot.posToVal(x, 'x') + (picture()?.origin ?? 0)
  const wheel = (event: WheelEvent) => {
    const now = picture()
    if (!now) return
    event.preventDefault()
    const { x, y } = place(event)
    const factor = wheelFactor(event)
    if (event.shiftKey) {
      for (const { unit } of yAxes(plot)) zoomY(plot, unit, y, factor, events)
      return
    }
    const centre = timeAt(x)
    events.current.onStretch(
      centre - (centre - now.from) * factor,
      centre + (now.to - centre) * factor,
    )
  }
  const down = (event: PointerEvent) => {
    const now = picture()
    if (!now || now.cursors.length === 0 || !event.isPrimary) return
    const { x } = place(event)
    const distances = now.cursors.map((time) => Math.abs(plot.valToPos(time - now.origin, 'x') - x))
    const nearest = distances.indexOf(Math.min(...distances))
    dragged = nearest
    plot.over.setPointerCapture(event.pointerId)
    if ((distances[nearest] ?? 0) > GRAB_PX) events.current.onCursor(nearest, timeAt(x))
  }
  const move = (event: PointerEvent) => {
    if (dragged !== null && event.isPrimary)
      events.current.onCursor(dragged, timeAt(place(event).x))
  }
  const up = () => {
    dragged = null
  }
  return all(
    heard(plot.over, 'wheel', wheel),
    heard(plot.over, 'pointerdown', down),
    heard(plot.over, 'pointermove', move),
    heard(plot.over, 'pointerup', up),
    heard(plot.over, 'pointercancel', up),
    heard(plot.over, 'dblclick', () => events.current.onFollow()),
  )
}

/** Two fingers: apart sideways zooms time, apart up and down zooms every y scale. */
function pinch(plot: uPlot, picture: () => Picture | null, events: Events): Stop {
  let began: { width: number; height: number; from: number; to: number; spans: Map<string, Span> }
  let pinching = false
  const fingers = (event: TouchEvent) => {
    const box = plot.over.getBoundingClientRect()
    const [a, b] = [event.touches[0], event.touches[1]]
    if (event.touches.length !== 2 || !a || !b) return null
    return {
      width: Math.abs(a.clientX - b.clientX),
      height: Math.abs(a.clientY - b.clientY),
      x: (a.clientX + b.clientX) / 2 - box.left,
      y: (a.clientY + b.clientY) / 2 - box.top,
    }
  }
  const start = (event: TouchEvent) => {
    const now = picture()
    const held = fingers(event)
    pinching = false
    if (!now || !held) return
    event.preventDefault() // else the page scrolls or zooms beneath the fingers
    const spans = yAxes(plot).flatMap(({ unit }): [string, Span][] => {
      const span = spanOf(plot, unit)
      return span ? [[unit, span]] : []
    })
    const { width, height } = held
    began = { width, height, from: now.from, to: now.to, spans: new Map(spans) }
    pinching = true
  }
  const move = (event: TouchEvent) => {
    const held = fingers(event)
    if (!pinching || !held) return
    event.preventDefault()
    const sideways = began.width >= began.height
    if (sideways && began.width >= PINCH_PX) {
      const factor = began.width / Math.max(held.width, 1)
      const part = held.x / Math.max(plot.over.clientWidth, 1)
      const centre = began.from + (began.to - began.from) * part
      events.current.onStretch(
        centre - (centre - began.from) * factor,
        centre + (began.to - centre) * factor,
      )
    } else if (!sideways && began.height >= PINCH_PX) {
      const factor = began.height / Math.max(held.height, 1)
      const part = held.y / Math.max(plot.over.clientHeight, 1)
      for (const [unit, span] of began.spans) {
        const centre = span.max - (span.max - span.min) * part
        events.current.onRange(unit, zoomed(span, centre, factor))
      }
    }
  }
  return all(heard(plot.over, 'touchstart', start), heard(plot.over, 'touchmove', move))
}

/** On a y axis: the wheel zooms its scale, dragging moves it, two clicks let it follow again. */
function onAxis(plot: uPlot, unit: string, element: HTMLElement, events: Events): Stop {
  element.classList.add('y-axis')
  let held: { y: number; span: Span } | null = null
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const y = event.clientY - plot.over.getBoundingClientRect().top
    zoomY(plot, unit, y, wheelFactor(event), events)
  }
  const down = (event: PointerEvent) => {
    const span = spanOf(plot, unit)
    if (!span) return
    held = { y: event.clientY, span }
    element.setPointerCapture(event.pointerId)
  }
  const move = (event: PointerEvent) => {
    if (!held) return
    const { min, max } = held.span
    const by = ((event.clientY - held.y) / Math.max(plot.over.clientHeight, 1)) * (max - min)
    if (by !== 0) events.current.onRange(unit, moved(held.span, by))
  }
  const up = () => {
    held = null
  }
  return all(
    heard(element, 'wheel', wheel),
    heard(element, 'pointerdown', down),
    heard(element, 'pointermove', move),
    heard(element, 'pointerup', up),
    heard(element, 'pointercancel', up),
    heard(element, 'dblclick', () => events.current.onRange(unit, null)),
  )
}
