import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import type { Columns } from '../live/scope/decimate'
import { figure } from '../widgets/numbers/format'
import { axisLook } from './geometry/axis'
import { listen, type PlotEvents } from './gestures'
import { lineWidth } from './geometry/line-width'
import { Extent, type Span, withAir } from './geometry/yscale'
import { sharedCursor } from './shared-cursor'

interface PlotSeries {
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

interface PlotFrame {
  columns: Columns
  from: number
  to: number
  /** Time that is shown as zero. */
  origin: number
  /** Level line of the trigger, on the scale of its unit. */
  level: { unit: string; value: number; color: string } | null
  cursors: number[]
  overlays?: PlotOverlay[]
  /** Fixed scales by unit; the other units follow what is in sight. */
  ranges: ReadonlyMap<string, Span>
}

/** Where frames are handed in, so that thirty a second do not pass through React. */
export interface PlotHandle {
  draw(frame: PlotFrame): void
  width(): number
  /** What the scale of a unit shows now. */
  range(unit: string): Span | null
}

/** Scale of the traces that have no unit. */
const NO_UNIT = '–'
/** uPlot.Axis.Side, which as an ambient const enum cannot be imported. */
const LEFT = 3
const RIGHT = 1
const SHORTEST_S = 1e-5
/**
 * Narrower than this the y axes make room for the traces: the unit takes the highest number's
 * place.
 */
const NARROW_PX = 500
/** Mark of a trace that leaves a fixed scale. */
const BEYOND_PX = 7

/**
 * Traces over time, one y scale per unit. Dragging zooms (or moves a cursor when there are any),
 * the wheel zooms about the pointer, two clicks follow again; Shift and the wheel, or the wheel on
 * an axis, zoom its scale. Two fingers zoom in the direction in which they lie.
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
  onRange,
}: {
  series: PlotSeries[]
  dark: boolean
  label: string
  timeLabel: string
  handle: (handle: PlotHandle | null) => void
} & PlotEvents) {
  const box = useRef<HTMLDivElement>(null)
  const events = useRef({ onStretch, onFollow, onCursor, onRange })
  events.current = {
    onStretch,
    onFollow,
    onCursor,
    onRange: (scale, span) => onRange(scale === NO_UNIT ? '' : scale, span),
  }
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
        const points = rest.reduce((sum, column) => sum + column.length, 0)
        for (const each of plot.series) each.width = lineWidth(points, devicePixelRatio)
        plot.batch(() => {
          plot.setData([Float64Array.from(times, (time) => time - next.origin), ...rest], false)
          // A scale of no width would keep uPlot looking for ticks for ever.
          const end = Math.max(next.to, next.from + SHORTEST_S)
          plot.setScale('x', { min: next.from - next.origin, max: end - next.origin })
          for (const name of units(series)) plot.setScale(name, yRange(plot, series, name, next))
        })
      },
      width: () => plot.bbox.width / devicePixelRatio,
      range: (unit) => {
        const { min, max } = plot.scales[unit || NO_UNIT] ?? {}
        return typeof min === 'number' && typeof max === 'number' ? { min, max } : null
      },
    })
    return () => {
      handle(null)
      observer.disconnect()
      remove()
      plot.destroy()
    }
    // Built again only when what is drawn changes in kind.
  }, [shape])
  return <div ref={box} className="time-plot" role="img" aria-label={label} />
}

const units = (series: PlotSeries[]) => [...new Set(series.map((each) => each.unit || NO_UNIT))]

/** Colour of a unit's only trace, for its axis; null where several share the axis. */
function ownColor(series: PlotSeries[], unit: string): string | null {
  const [only, second] = series.filter((each) => (each.unit || NO_UNIT) === unit)
  return only && !second ? only.color : null
}

/** Range of a unit's scale: the fixed one, or over what is in sight. */
function yRange(plot: uPlot, series: PlotSeries[], unit: string, frame: PlotFrame): Span {
  const fixed = frame.ranges.get(unit === NO_UNIT ? '' : unit)
  if (fixed) return fixed
  const seen = new Extent()
  for (const [i, each] of series.entries()) {
    if ((each.unit || NO_UNIT) !== unit || plot.series[i + 1]?.show === false) continue
    for (const value of frame.columns[i + 1] ?? []) if (typeof value === 'number') seen.see(value)
  }
  for (const overlay of frame.overlays ?? []) {
    if ((overlay.unit || NO_UNIT) !== unit) continue
    for (const [i, time] of overlay.times.entries()) {
      const at = time + frame.origin
      if (at >= frame.from && at <= frame.to) seen.see(overlay.values[i] as number)
    }
  }
  if (frame.level && (frame.level.unit || NO_UNIT) === unit) seen.see(frame.level.value)
  return withAir(seen.span)
}

function options(
  series: PlotSeries[],
  timeLabel: string,
  size: { width: number; height: number },
  frame: () => PlotFrame | null,
  stretch: (from: number, to: number) => void,
): uPlot.Options {
  const look = axisLook()
  const axis = (extra: Partial<uPlot.Axis>): uPlot.Axis => ({
    ...look,
    values: (_plot, splits) => splits.map((value) => figure(value, 6)),
    ...extra,
  })
  const names = units(series)
  const narrow = size.width < NARROW_PX
  const named = (name: string): Partial<uPlot.Axis> =>
    name === NO_UNIT
      ? {}
      : narrow
        ? {
            values: (_plot, splits) =>
              splits.map((value, i) => (i === splits.length - 1 ? name : figure(value, 4))),
          }
        : { label: name }
  return {
    ...size,
    legend: { show: false },
    cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false } },
    plugins: [sharedCursor('scope', () => frame()?.origin ?? 0)],
    scales: {
      x: { time: false, auto: false },
      ...Object.fromEntries(names.map((name) => [name, { auto: false }])),
    },
    axes: [
      axis({ label: timeLabel, size: 34 }),
      ...names.map((name, i) =>
        axis({
          scale: name,
          ...named(name),
          stroke: ownColor(series, name) ?? look.stroke,
          // A sign and three figures, as −0.25. Fixed: the plot must not move with the numbers.
          size: narrow ? 50 : 60,
          // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment -- see LEFT
          side: i % 2 === 0 ? LEFT : RIGHT,
          grid: { ...look.grid, show: i === 0 },
        }),
      ),
    ],
    series: [
      {},
      ...series.map((each) => ({
        label: each.label,
        scale: each.unit || NO_UNIT,
        stroke: each.color,
        spanGaps: true,
        points: { show: false },
      })),
    ],
    hooks: {
      draw: [
        (plot) => drawMarks(plot, frame(), look.stroke),
        (plot) => drawBeyond(plot, frame(), series),
      ],
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
  const overlays = frame.overlays ?? []
  const points = overlays.reduce((sum, each) => sum + each.times.length, 0)
  for (const overlay of overlays) drawOverlay(plot, overlay, points)
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

/** A triangle at the edge of a fixed scale for each trace that goes beyond it. */
function drawBeyond(plot: uPlot, frame: PlotFrame | null, series: PlotSeries[]): void {
  if (!frame || frame.ranges.size === 0) return
  const { ctx, bbox } = plot
  const size = BEYOND_PX * devicePixelRatio
  for (const [i, { unit, color }] of series.entries()) {
    const range = frame.ranges.get(unit)
    if (!range) continue
    const seen = new Extent()
    for (const value of frame.columns[i + 1] ?? []) if (typeof value === 'number') seen.see(value)
    const x = bbox.left + bbox.width - (i + 1) * 2.4 * size
    const mark = (tip: number, base: number) => {
      ctx.fillStyle = color
      ctx.beginPath()
      ctx.moveTo(x, tip)
      ctx.lineTo(x - size, base)
      ctx.lineTo(x + size, base)
      ctx.fill()
    }
    if (seen.span && seen.span.max > range.max) mark(bbox.top, bbox.top + 1.6 * size)
    const foot = bbox.top + bbox.height
    if (seen.span && seen.span.min < range.min) mark(foot, foot - 1.6 * size)
  }
}

/** One of the overlays, which have so many points together. */
function drawOverlay(plot: uPlot, overlay: PlotOverlay, points: number): void {
  const { ctx, bbox } = plot
  const scale = overlay.unit || NO_UNIT
  if (!plot.scales[scale]) return // no trace of this unit is shown
  ctx.save()
  ctx.beginPath()
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height)
  ctx.clip()
  ctx.globalAlpha = overlay.opacity ?? 0.8
  ctx.strokeStyle = overlay.color
  ctx.lineWidth = Math.min(1.2, lineWidth(points, devicePixelRatio)) * devicePixelRatio
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
