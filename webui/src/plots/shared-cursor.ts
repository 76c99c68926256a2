import { type RefObject, useEffect, useRef } from 'react'
import type uPlot from 'uplot'
import {
  cursorsOn,
  heldInside,
  isShared,
  type Pointed,
  Pointing,
  type PlotName,
} from '../live/scope/analysis/cursors'
import * as live from '../live/live'
import { people } from '../live/people'
import { subscribe } from '../live/store'
import './shared-cursor.css'

const SEND_MS = 80

const pointing = new Pointing(live.send)
const shown = new Set<() => void>()
let timer: ReturnType<typeof setInterval> | null = null

/** While plots are in sight, and a guest is here. */
function keepPublishing(): void {
  const wanted = shown.size > 0 && isShared(people.here)
  if (wanted) timer ??= setInterval(() => pointing.tick(isShared(people.here)), SEND_MS)
  else if (timer !== null) {
    clearInterval(timer)
    timer = null
    pointing.tick(false)
  }
}

/** How the area of a plot and its data belong together; places are px from its left and top. */
export interface Field {
  /** What is pointed at, or null where there is nothing. */
  read: (left: number, top: number) => Pointed | null
  /** Where that is drawn: across, and down where it is a point; null where it cannot be. */
  place: (at: Pointed) => { left: number; top: number | null } | null
}

/**
 * Shows where the others point on a plot and shows them of this page's pointer, in the data's own
 * coordinates. `draw` is to be called when the data or their places change.
 */
function shareCursors(
  over: HTMLElement,
  name: PlotName,
  field: Field,
): { draw: () => void; stop: () => void } {
  const layer = document.createElement('div')
  layer.className = 'shared-cursors'
  layer.setAttribute('aria-hidden', 'true')
  over.append(layer)
  const draw = () => drawOthers(over, layer, name, field)
  const forget = [
    subscribe('cursors', draw),
    subscribe('people', draw),
    subscribe('people', keepPublishing),
    follow(over, name, field),
  ]
  shown.add(draw)
  keepPublishing()
  draw()
  const stop = () => {
    for (const each of forget) each()
    layer.remove()
    shown.delete(draw)
    keepPublishing()
  }
  return { draw, stop }
}

/** For plots over one coordinate: what the axis shows plus `origin`. */
export function sharedCursor(name: PlotName, origin: () => number = () => 0): uPlot.Plugin {
  let sharing: ReturnType<typeof shareCursors> | null = null
  return {
    hooks: {
      ready: (plot) => {
        sharing = shareCursors(plot.over, name, {
          read: (left) => {
            const x = plot.posToVal(left, 'x') + origin()
            return Number.isFinite(x) ? { x, y: null } : null
          },
          place: ({ x }) => {
            // A plot that is still empty has no scale, and a logarithmic one no zero.
            const left = plot.valToPos(x - origin(), 'x')
            return Number.isFinite(left) ? { left, top: null } : null
          },
        })
      },
      draw: () => sharing?.draw(),
      destroy: () => sharing?.stop(),
    },
  }
}

/** For plots that are drawn otherwise, on the element that lies on their data. */
export function useSharedCursor(
  over: RefObject<HTMLElement | null>,
  name: PlotName,
  field: Field,
): void {
  const latest = useRef(field)
  latest.current = field
  const draw = useRef(() => {})
  useEffect(() => {
    const element = over.current
    if (!element) return
    const sharing = shareCursors(element, name, {
      read: (left, top) => latest.current.read(left, top),
      place: (at) => latest.current.place(at),
    })
    draw.current = sharing.draw
    const observer = new ResizeObserver(sharing.draw)
    observer.observe(element)
    return () => {
      draw.current = () => {}
      observer.disconnect()
      sharing.stop()
    }
  }, [over, name])
  useEffect(() => draw.current())
}

/** The pointer over the plot, by finger too. */
function follow(over: HTMLElement, name: PlotName, field: Field): () => void {
  let at: { left: number; top: number } | null = null
  const read = () => at && field.read(at.left, at.top)
  const move = (event: PointerEvent) => {
    const box = over.getBoundingClientRect()
    at = { left: event.clientX - box.left, top: event.clientY - box.top }
    pointing.enter(name, read)
  }
  const gone = () => pointing.leave(read)
  over.addEventListener('pointermove', move, { passive: true })
  over.addEventListener('pointerleave', gone)
  over.addEventListener('pointercancel', gone)
  return () => {
    gone()
    over.removeEventListener('pointermove', move)
    over.removeEventListener('pointerleave', gone)
    over.removeEventListener('pointercancel', gone)
  }
}

function drawOthers(over: HTMLElement, layer: HTMLElement, name: PlotName, field: Field): void {
  const page = window.location.hash.replace(/^#/, '')
  const others = cursorsOn(name, page, people.here, people.cursors.values())
  while (layer.childElementCount > others.length) layer.lastElementChild?.remove()
  for (const [i, { person, x, y }] of others.entries()) {
    const mark = (layer.children[i] ?? layer.appendChild(newMark())) as HTMLElement
    const at = field.place({ x, y })
    mark.hidden = at === null
    if (!at) continue
    const { left, beyond } = heldInside(at.left, over.clientWidth)
    mark.style.left = `${left}px`
    mark.style.setProperty('--top', `${at.top ?? 0}px`)
    mark.classList.toggle('point', at.top !== null && beyond === 0)
    mark.classList.toggle('beyond', beyond !== 0)
    mark.classList.toggle('at-right', left > over.clientWidth / 2)
    const label = mark.firstElementChild
    // Only ever as text: a name is whatever somebody typed.
    if (label) label.textContent = beyond < 0 ? `◀ ${person}` : beyond > 0 ? `${person} ▶` : person
  }
}

function newMark(): HTMLElement {
  const mark = document.createElement('div')
  mark.className = 'shared-cursor'
  mark.append(document.createElement('span'))
  return mark
}
