import type uPlot from 'uplot'
import {
  moved,
  type Pinch,
  pinched,
  type Span,
  sound,
  wheelFactor,
  zoomed,
} from './geometry/yscale'

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
/** What the fingers do, for all that listens to them. */
type Hand = { pinching: boolean }

const GRAB_PX = 14
/** A fingertip is broader than a pointer. */
const TOUCH_PX = 24
/** Fingers nearer to each other than this in one direction do not zoom in it. */
const PINCH_PX = 20

/** Wheel, cursors and fingers on the plot, wheel and drag on its y axes. */
export function listen(plot: uPlot, picture: () => Picture | null, events: Events): Stop {
  const hand = { pinching: false }
  const stops = [
    wheelAndCursors(plot, picture, events, hand),
    pinch(plot, picture, events, hand),
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

function wheelAndCursors(
  plot: uPlot,
  picture: () => Picture | null,
  events: Events,
  hand: Hand,
): Stop {
  let dragged: number | null = null
  /** A finger away from the cursors: it may tap, and it may begin to scroll or to zoom. */
  let tapped: { x: number; y: number; nearest: number } | null = null
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
    const { x, y } = place(event)
    const distances = now.cursors.map((time) => Math.abs(plot.valToPos(time - now.origin, 'x') - x))
    const nearest = distances.indexOf(Math.min(...distances))
    const touch = event.pointerType === 'touch'
    const near = (distances[nearest] ?? 0) <= (touch ? TOUCH_PX : GRAB_PX)
    if (touch && !near) {
      tapped = { x, y, nearest }
      return
    }
    dragged = nearest
    plot.over.setPointerCapture(event.pointerId)
    if (!near) events.current.onCursor(nearest, timeAt(x))
  }
  const move = (event: PointerEvent) => {
    if (hand.pinching) drop()
    if (dragged !== null && event.isPrimary)
      events.current.onCursor(dragged, timeAt(place(event).x))
  }
  const drop = () => {
    dragged = tapped = null
  }
  const up = (event: PointerEvent) => {
    const { x, y } = place(event)
    if (tapped && !hand.pinching && Math.hypot(x - tapped.x, y - tapped.y) < GRAB_PX)
      events.current.onCursor(tapped.nearest, timeAt(x))
    drop()
  }
  return all(
    heard(plot.over, 'wheel', wheel),
    heard(plot.over, 'pointerdown', down),
    heard(plot.over, 'pointermove', move),
    heard(plot.over, 'pointerup', up),
    heard(plot.over, 'pointercancel', drop),
    heard(plot.over, 'dblclick', () => events.current.onFollow()),
  )
}

/** Two fingers next to each other zoom and move time, one above the other every y scale. */
function pinch(plot: uPlot, picture: () => Picture | null, events: Events, hand: Hand): Stop {
  let began: { fingers: Fingers; time: Span; spans: Map<string, Span> } | null = null
  const start = (event: TouchEvent) => {
    const now = picture()
    const fingers = fingersOn(plot, event)
    began = null
    hand.pinching = event.touches.length > 1
    if (!now || !fingers) return
    event.preventDefault() // else the page scrolls or zooms beneath the fingers
    const spans = yAxes(plot).flatMap(({ unit }): [string, Span][] => {
      const span = spanOf(plot, unit)
      return span ? [[unit, span]] : []
    })
    began = { fingers, time: { min: now.from, max: now.to }, spans: new Map(spans) }
  }
  const move = (event: TouchEvent) => {
    const fingers = fingersOn(plot, event)
    if (!began || !fingers) return
    event.preventDefault()
    const { across, up } = began.fingers
    if (across.apart >= up.apart && across.apart >= PINCH_PX) {
      const { min, max } = pinched(began.time, across, fingers.across)
      events.current.onStretch(min, max)
    } else if (across.apart < up.apart && up.apart >= PINCH_PX) {
      for (const [unit, span] of began.spans)
        events.current.onRange(unit, sound(pinched(span, up, fingers.up)))
    }
  }
  const end = (event: TouchEvent) => {
    // A finger that stays goes on as part of the gesture that it began, not as a new one.
    if (event.touches.length === 0) hand.pinching = false
    began = null
  }
  return all(
    heard(plot.over, 'touchstart', start),
    heard(plot.over, 'touchmove', move),
    heard(plot.over, 'touchend', end),
    heard(plot.over, 'touchcancel', end),
  )
}

interface Fingers {
  across: Pinch
  up: Pinch
}

/** Where the two fingers are that touch, if it is two. */
function fingersOn(plot: uPlot, event: TouchEvent): Fingers | null {
  const box = plot.over.getBoundingClientRect()
  const [a, b] = [event.touches[0], event.touches[1]]
  if (event.touches.length !== 2 || !a || !b || box.width === 0 || box.height === 0) return null
  return {
    across: {
      apart: Math.abs(a.clientX - b.clientX),
      part: ((a.clientX + b.clientX) / 2 - box.left) / box.width,
    },
    up: {
      apart: Math.abs(a.clientY - b.clientY),
      part: 1 - ((a.clientY + b.clientY) / 2 - box.top) / box.height,
    },
  }
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
