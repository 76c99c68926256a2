import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import type { Columns } from '../live/decimate'
import { figure } from '../widgets/format'

export interface PlotSeries {
  label: string
  unit: string
  color: string
}

/** A curve that is not of the running picture: an earlier sweep, or a reference. */
export interface PlotOverlay {
  unit: string
  color: string
  dashed: boolean
  opacity?: number
  /** Seconds from what is shown as zero. */
  times: number[]
  values: number[]
}

export interface PlotFrame {
  columns: Columns
  from: number
  to: number
  /** Time that is shown as zero. */
  origin: number
  /** Level line of the trigger, on the scale of its unit. */
  level: { unit: string; value: number; color: string } | null
  cursors: number[]
  overlays?: PlotOverlay[]
}

/** Where frames are handed in, so that thirty a second do not pass through React. */
export interface PlotHandle {
  draw(frame: PlotFrame): void
  width(): number
}

/** Scale of the traces that have no unit. */
const NO_UNIT = '–'
/** uPlot.Axis.Side, which as an ambient const enum cannot be imported. */
const LEFT = 3
const RIGHT = 1
const GRAB_PX = 14
const SHORTEST_S = 1e-5
/** Narrower than this the y axes make room for the traces. */
const NARROW_PX = 500
const WHEEL_ZOOM = 1.25

/**
 * Traces over time, one y scale per unit. Dragging zooms (or moves a cursor when there are any),
 * the wheel zooms about the pointer, two clicks follow again.
 */
export function TimePlot({
  series,
  dark,
  label,
  timeLabel,
  handle,
  onStretch,
  onFollow,
  onCursor,
}: {
  series: PlotSeries[]
  dark: boolean
  label: string
  timeLabel: string
  handle: (handle: PlotHandle | null) => void
  onStretch: (from: number, to: number) => void
  onFollow: () => void
  onCursor: (index: number, time: number) => void
}) {
  const box = useRef<HTMLDivElement>(null)
  const events = useRef({ onStretch, onFollow, onCursor })
  events.current = { onStretch, onFollow, onCursor }
  const shape = JSON.stringify([series, dark, timeLabel])
  useEffect(() => {
    const element = box.current
    if (!element) return
    const frame: { now: PlotFrame | null } = { now: null }
    const size = () => ({
      width: Math.max(200, element.clientWidth),
      height: Math.max(160, element.clientHeight),
    })
    const plot = new uPlot(
      options(
        series,
        timeLabel,
        size(),
        () => frame.now,
        (from, to) => events.current.onStretch(from, to),
      ),
      [[], ...series.map(() => [])] as uPlot.AlignedData,
      element,
    )
    const remove = listen(plot, () => frame.now, events)
    const observer = new ResizeObserver(() => plot.setSize(size()))
    observer.observe(element)
    handle({
      draw(next) {
        frame.now = next
        const [times, ...rest] = next.columns
        plot.batch(() => {
          plot.setData(
            [times.map((time) => time - next.origin), ...rest] as uPlot.AlignedData,
            false,
          )
          // A scale of no width would keep uPlot looking for ticks for ever.
          const end = Math.max(next.to, next.from + SHORTEST_S)
          plot.setScale('x', { min: next.from - next.origin, max: end - next.origin })
          for (const name of units(series)) plot.setScale(name, yRange(plot, series, name, next))
        })
      },
      width: () => plot.bbox.width / devicePixelRatio,
    })
    return () => {
      handle(null)
      observer.disconnect()
      remove()
      plot.destroy()
    }
    // Built anew only when what is drawn changes in kind.
  }, [shape])
  return <div ref={box} className="time-plot" role="img" aria-label={label} />
}

const units = (series: PlotSeries[]) => [...new Set(series.map((each) => each.unit || NO_UNIT))]

/** Range of a unit's scale over what is in sight, with some air, never of no height. */
function yRange(
  plot: uPlot,
  series: PlotSeries[],
  unit: string,
  frame: PlotFrame,
): { min: number; max: number } {
  let min = Number.POSITIVE_INFINITY
  let max = Number.NEGATIVE_INFINITY
  for (const [i, each] of series.entries()) {
    if ((each.unit || NO_UNIT) !== unit || plot.series[i + 1]?.show === false) continue
    for (const value of frame.columns[i + 1] ?? []) {
      if (typeof value !== 'number') continue
      if (value < min) min = value
      if (value > max) max = value
    }
  }
  for (const overlay of frame.overlays ?? []) {
    if ((overlay.unit || NO_UNIT) !== unit) continue
    for (const [i, time] of overlay.times.entries()) {
      const at = time + frame.origin
      if (at < frame.from || at > frame.to) continue
      const value = overlay.values[i] as number
      if (value < min) min = value
      if (value > max) max = value
    }
  }
  if (frame.level && (frame.level.unit || NO_UNIT) === unit) {
    min = Math.min(min, frame.level.value)
    max = Math.max(max, frame.level.value)
  }
  if (min > max) return { min: -1, max: 1 }
  const air = (max - min) * 0.08 || Math.abs(max) * 0.1 || 1
  return { min: min - air, max: max + air }
}

function options(
  series: PlotSeries[],
  timeLabel: string,
  size: { width: number; height: number },
  frame: () => PlotFrame | null,
  stretch: (from: number, to: number) => void,
): uPlot.Options {
  const style = getComputedStyle(document.documentElement)
  const text = style.getPropertyValue('--dim')
  const grid = style.getPropertyValue('--line')
  const font = `12px ${getComputedStyle(document.body).fontFamily}`
  const axis = (extra: Partial<uPlot.Axis>): uPlot.Axis => ({
    stroke: text,
    font,
    labelFont: font,
    grid: { stroke: grid, width: 1 },
    ticks: { stroke: grid, width: 1 },
    values: (_plot, splits) => splits.map((value) => figure(value, 6)),
    ...extra,
  })
  const names = units(series)
  return {
    ...size,
    legend: { show: false },
    cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false } },
    scales: {
      x: { time: false, auto: false },
      ...Object.fromEntries(names.map((name) => [name, { auto: false }])),
    },
    axes: [
      axis({ label: timeLabel, labelSize: 18, size: 34 }),
      ...names.map((name, i) =>
        axis({
          scale: name,
          ...(name === NO_UNIT ? {} : { label: name, labelSize: 18 }),
          size: size.width < NARROW_PX ? 44 : 60,
          // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment -- see LEFT
          side: i % 2 === 0 ? LEFT : RIGHT,
          grid: { show: i === 0, stroke: grid, width: 1 },
        }),
      ),
    ],
    series: [
      {},
      ...series.map((each) => ({
        label: each.label,
        scale: each.unit || NO_UNIT,
        stroke: each.color,
        width: 1.5,
        spanGaps: true,
        points: { show: false },
      })),
    ],
    hooks: {
      draw: [(plot) => drawMarks(plot, frame(), text)],
      setSelect: [
        (plot) => {
          const now = frame()
          if (!now || plot.select.width < 6) return
          const from = plot.posToVal(plot.select.left, 'x') + now.origin
          const to = plot.posToVal(plot.select.left + plot.select.width, 'x') + now.origin
          plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false)
          if (now.cursors.length === 0) stretch(from, to)
        },
      ],
    },
  }
}

function drawMarks(plot: uPlot, frame: PlotFrame | null, color: string): void {
  if (!frame) return
  const { ctx, bbox } = plot
  ctx.save()
  for (const overlay of frame.overlays ?? []) drawOverlay(plot, overlay)
  ctx.lineWidth = devicePixelRatio
  for (const [i, time] of frame.cursors.entries()) {
    const x = plot.valToPos(time - frame.origin, 'x', true)
    if (x < bbox.left || x > bbox.left + bbox.width) continue
    ctx.strokeStyle = color
    ctx.setLineDash([6, 4])
    line(ctx, x, bbox.top, x, bbox.top + bbox.height)
    ctx.fillStyle = color
    ctx.font = `bold ${13 * devicePixelRatio}px sans-serif`
    ctx.fillText('AB'[i] ?? '', x + 4, bbox.top + 16 * devicePixelRatio)
  }
  if (frame.level) {
    const y = plot.valToPos(frame.level.value, frame.level.unit || NO_UNIT, true)
    ctx.strokeStyle = frame.level.color
    ctx.setLineDash([2, 4])
    line(ctx, bbox.left, y, bbox.left + bbox.width, y)
  }
  ctx.restore()
}

function drawOverlay(plot: uPlot, overlay: PlotOverlay): void {
  const { ctx, bbox } = plot
  const scale = overlay.unit || NO_UNIT
  if (!plot.scales[scale]) return // no trace of this unit is shown
  ctx.save()
  ctx.beginPath()
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height)
  ctx.clip()
  ctx.globalAlpha = overlay.opacity ?? 0.8
  ctx.strokeStyle = overlay.color
  ctx.lineWidth = 1.2 * devicePixelRatio
  ctx.setLineDash(overlay.dashed ? [6, 4] : [])
  ctx.beginPath()
  for (const [i, time] of overlay.times.entries()) {
    ctx.lineTo(
      plot.valToPos(time, 'x', true),
      plot.valToPos(overlay.values[i] as number, scale, true),
    )
  }
  ctx.stroke()
  ctx.restore()
}

function line(ctx: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  ctx.beginPath()
  ctx.moveTo(x0, y0)
  ctx.lineTo(x1, y1)
  ctx.stroke()
}

function listen(
  plot: uPlot,
  frame: () => PlotFrame | null,
  events: {
    current: {
      onStretch: (from: number, to: number) => void
      onFollow: () => void
      onCursor: (index: number, time: number) => void
    }
  },
): () => void {
  let dragged: number | null = null
  const timeAt = (event: MouseEvent) =>
    plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, 'x') +
    (frame()?.origin ?? 0)
  const wheel = (event: WheelEvent) => {
    const now = frame()
    if (!now) return
    event.preventDefault()
    const centre = timeAt(event)
    const factor = event.deltaY > 0 ? WHEEL_ZOOM : 1 / WHEEL_ZOOM
    events.current.onStretch(
      centre - (centre - now.from) * factor,
      centre + (now.to - centre) * factor,
    )
  }
  const down = (event: PointerEvent) => {
    const now = frame()
    if (!now || now.cursors.length === 0) return
    const x = event.clientX - plot.over.getBoundingClientRect().left
    const distances = now.cursors.map((time) => Math.abs(plot.valToPos(time - now.origin, 'x') - x))
    const nearest = distances.indexOf(Math.min(...distances))
    dragged = nearest
    plot.over.setPointerCapture(event.pointerId)
    if ((distances[nearest] ?? 0) > GRAB_PX) events.current.onCursor(nearest, timeAt(event))
  }
  const move = (event: PointerEvent) => {
    if (dragged !== null) events.current.onCursor(dragged, timeAt(event))
  }
  const up = () => {
    dragged = null
  }
  const twice = () => events.current.onFollow()
  plot.over.addEventListener('wheel', wheel, { passive: false })
  plot.over.addEventListener('pointerdown', down)
  plot.over.addEventListener('pointermove', move)
  plot.over.addEventListener('pointerup', up)
  plot.over.addEventListener('dblclick', twice)
  return () => {
    plot.over.removeEventListener('wheel', wheel)
    plot.over.removeEventListener('pointerdown', down)
    plot.over.removeEventListener('pointermove', move)
    plot.over.removeEventListener('pointerup', up)
    plot.over.removeEventListener('dblclick', twice)
  }
}
