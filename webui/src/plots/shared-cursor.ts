import type uPlot from 'uplot'
import { cursorsOn, heldInside, isShared, Pointing, type PlotName } from '../live/cursors'
import * as live from '../live/live'
import { people } from '../live/people'
import { subscribe } from '../live/store'
import './shared-cursor.css'

const SEND_MS = 80

const pointing = new Pointing(live.send)
const shown = new Set<() => void>()
let timer: ReturnType<typeof setInterval> | null = null

/** While plots are in sight, and a guest is here. */
function keepTelling(): void {
  const wanted = shown.size > 0 && isShared(people.here)
  if (wanted) timer ??= setInterval(() => pointing.tick(isShared(people.here)), SEND_MS)
  else if (timer !== null) {
    clearInterval(timer)
    timer = null
    pointing.tick(false)
  }
}

/**
 * Shows where the others point on this plot and tells them of this page's pointer, in the data's
 * own coordinate: what the axis shows plus `origin`.
 */
export function sharedCursor(name: PlotName, origin: () => number = () => 0): uPlot.Plugin {
  let remove = () => {}
  let place = () => {}
  return {
    hooks: {
      ready: (plot) => {
        const layer = document.createElement('div')
        layer.className = 'shared-cursors'
        layer.setAttribute('aria-hidden', 'true')
        plot.over.append(layer)
        place = () => draw(plot, layer, name, origin())
        const forget = [
          subscribe('cursors', place),
          subscribe('people', place),
          subscribe('people', keepTelling),
          follow(plot, name, origin),
        ]
        shown.add(place)
        keepTelling()
        place()
        remove = () => {
          for (const each of forget) each()
          shown.delete(place)
          keepTelling()
        }
      },
      draw: () => place(),
      destroy: () => remove(),
    },
  }
}

/** The pointer over the plot, by finger too. */
function follow(plot: uPlot, name: PlotName, origin: () => number): () => void {
  let left: number | null = null
  const read = () => {
    const x = left === null ? Number.NaN : plot.posToVal(left, 'x') + origin()
    return Number.isFinite(x) ? x : null
  }
  const move = (event: PointerEvent) => {
    left = event.clientX - plot.over.getBoundingClientRect().left
    pointing.enter(name, read)
  }
  const gone = () => pointing.leave(read)
  plot.over.addEventListener('pointermove', move, { passive: true })
  plot.over.addEventListener('pointerleave', gone)
  plot.over.addEventListener('pointercancel', gone)
  return () => {
    gone()
    plot.over.removeEventListener('pointermove', move)
    plot.over.removeEventListener('pointerleave', gone)
    plot.over.removeEventListener('pointercancel', gone)
  }
}

function draw(plot: uPlot, layer: HTMLElement, name: PlotName, origin: number): void {
  const page = window.location.hash.replace(/^#/, '')
  const others = cursorsOn(name, page, people.here, people.cursors.values())
  while (layer.childElementCount > others.length) layer.lastElementChild?.remove()
  for (const [i, { person, x }] of others.entries()) {
    const mark = (layer.children[i] ?? layer.appendChild(newMark())) as HTMLElement
    const at = plot.valToPos(x - origin, 'x')
    // A plot that is still empty has no scale, and a logarithmic one no zero.
    mark.hidden = !Number.isFinite(at)
    if (mark.hidden) continue
    const { left, beyond } = heldInside(at, plot.over.clientWidth)
    mark.style.transform = `translateX(${left}px)`
    mark.classList.toggle('beyond', beyond !== 0)
    mark.classList.toggle('at-right', left > plot.over.clientWidth / 2)
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
