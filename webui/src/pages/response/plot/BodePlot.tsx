import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import type { PlotName } from '../../../live/scope/analysis/cursors'
import { axisLook } from '../../../plots/geometry/axis'
import { sharedCursor } from '../../../plots/shared-cursor'
import { figure } from '../../../widgets/numbers/format'
import { dragMarkers } from './drag'
import { type Curve, gridOf, hertz, logTicks, onGrid, type Part, partOf, rangeOf } from './bode'

/** A vertical line over all parts that can be dragged. */
export interface Marker {
  id: string
  label: string
  frequency: number
  color: string
}

interface Frame {
  curves: Curve[]
  markers: Marker[]
  band: [number, number] | null
  shown: [number, number]
}

const HEIGHTS: Record<Part, number> = { magnitude: 260, phase: 180, coherence: 100 }
/** Room that the number of a frequency takes. */
const LABEL_PX = 54
/** uPlot.Scale.Distr, which as an ambient const enum cannot be imported. */
const LOGARITHMIC = 3

/** Magnitude, phase and coherence over a common logarithmic frequency axis. */
export function BodePlot({
  curves,
  markers,
  band,
  shown,
  unit,
  label,
  dark,
  shared = 'response',
  onMarker,
}: {
  curves: Curve[]
  markers: Marker[]
  /** Where the estimate holds; shaded. */
  band: [number, number] | null
  /** Frequencies in sight. */
  shown: [number, number]
  unit: string
  label: string
  dark: boolean
  /** Name by which people share their cursors on it. */
  shared?: PlotName
  onMarker: (id: string, frequency: number) => void
}) {
  const coherent = curves.some((curve) => curve.coherence)
  const parts: Part[] = coherent ? ['magnitude', 'phase', 'coherence'] : ['magnitude', 'phase']
  return (
    <div className="bode" role="img" aria-label={label}>
      {parts.map((part, i) => (
        <BodePart
          key={part}
          part={part}
          last={i === parts.length - 1}
          unit={
            part === 'magnitude'
              ? unit === '1'
                ? 'dB'
                : `dB (${unit})`
              : part === 'phase'
                ? '°'
                : ''
          }
          frame={{ curves, markers, band, shown }}
          dark={dark}
          shared={shared}
          onMarker={onMarker}
        />
      ))}
    </div>
  )
}

function BodePart({
  part,
  last,
  unit,
  frame,
  dark,
  shared,
  onMarker,
}: {
  part: Part
  last: boolean
  unit: string
  frame: Frame
  dark: boolean
  shared: PlotName
  onMarker: (id: string, frequency: number) => void
}) {
  const box = useRef<HTMLDivElement>(null)
  const plotted = useRef<uPlot | null>(null)
  const now = useRef(frame)
  now.current = frame
  const moved = useRef(onMarker)
  moved.current = onMarker
  const drawn = frame.curves.filter((curve) => part !== 'coherence' || curve.coherence)
  const shape = JSON.stringify([
    drawn.map((each) => [each.label, each.color, each.dashed, banded(each, part)]),
    part,
    last,
    unit,
    dark,
  ])
  useEffect(() => {
    const element = box.current
    if (!element) return
    const size = () => ({
      width: Math.max(200, element.clientWidth),
      height: HEIGHTS[part] + (last ? 26 : 0),
    })
    const plot = new uPlot(
      {
        ...options(drawn, part, last, unit, size(), () => now.current),
        plugins: [sharedCursor(shared)],
      },
      data(drawn, part),
      element,
    )
    plotted.current = plot
    const remove = dragMarkers(
      plot,
      () => now.current.markers,
      (id, frequency) => moved.current(id, frequency),
    )
    const observer = new ResizeObserver(() => plot.setSize(size()))
    observer.observe(element)
    return () => {
      observer.disconnect()
      remove()
      plotted.current = null
      plot.destroy()
    }
    // Built again only when what is drawn changes in kind.
  }, [shape])
  useEffect(() => {
    plotted.current?.setData(data(drawn, part))
  }, [frame.curves, frame.shown[0], frame.shown[1]])
  useEffect(() => {
    plotted.current?.redraw(false)
  }, [JSON.stringify([frame.markers, frame.band])])
  return <div ref={box} className="bode-part" />
}

const banded = (curve: Curve, part: Part) =>
  part !== 'coherence' && (part === 'magnitude' ? curve.stdMagnitude : curve.stdPhase) !== undefined

function data(curves: Curve[], part: Part): uPlot.AlignedData {
  const grid = gridOf(curves)
  const columns = curves.flatMap((curve) => {
    const { values, low, high } = partOf(curve, part)
    const lines = banded(curve, part) ? [values, low, high] : [values]
    return lines.map((each) => onGrid(grid, curve.frequency, each))
  })
  return [grid, ...columns] as uPlot.AlignedData
}

function options(
  curves: Curve[],
  part: Part,
  last: boolean,
  unit: string,
  size: { width: number; height: number },
  frame: () => Frame,
): uPlot.Options {
  const soft = getComputedStyle(document.documentElement).getPropertyValue('--accent-soft')
  const common = axisLook()
  const series: uPlot.Series[] = [{}]
  const bands: uPlot.Band[] = []
  for (const curve of curves) {
    const at = series.length
    series.push({
      label: curve.label,
      stroke: curve.color,
      width: 1.8,
      points: { show: false },
      ...(curve.dashed ? { dash: [6, 4] } : {}),
    })
    if (!banded(curve, part)) continue
    const edge: uPlot.Series = { stroke: 'transparent', width: 0, points: { show: false } }
    series.push(edge, edge)
    bands.push({ series: [at + 2, at + 1], fill: `${curve.color}40` })
  }
  return {
    ...size,
    legend: { show: false },
    padding: [8, 12, last ? 0 : 4, 0],
    cursor: {
      drag: { x: false, y: false, setScale: false },
      points: { show: false },
      sync: { key: 'bode' },
    },
    scales: {
      // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment -- see LOGARITHMIC
      x: { time: false, distr: LOGARITHMIC, log: 10, range: () => frame().shown },
      y: {
        range: () =>
          part === 'coherence' ? [0, 1.02] : rangeOf(frame().curves, part, frame().shown),
      },
    },
    axes: [
      {
        ...common,
        size: last ? 34 : 8,
        splits: (plot) => logTicks(plot.scales.x?.min ?? 1, plot.scales.x?.max ?? 1000),
        filter: (_plot, splits) => splits,
        values: (plot, splits) =>
          last ? thinned(plot, splits).map((f) => (f === null ? '' : hertz(f))) : [],
      },
      {
        ...common,
        size: 58,
        // A label on every part, so that their frequency axes stand in line.
        label: unit || ' ',
        ...(part === 'phase' ? { incrs: [15, 30, 45, 90, 180, 360] } : {}),
        ...(part === 'coherence' ? { splits: () => [0, 0.5, 1] } : {}),
        values: (_plot, splits) => splits.map((value) => figure(value, 4)),
      },
    ],
    series,
    bands,
    hooks: {
      drawClear: [(plot) => shade(plot, frame().band, soft)],
      draw: [(plot) => drawMarkers(plot, frame().markers, part === 'magnitude')],
    },
  }
}

/** The decades get a number, and of the others those that do not run into one. */
function thinned(plot: uPlot, splits: number[]): (number | null)[] {
  const place = (f: number) => plot.valToPos(f, 'x')
  const kept = splits.filter((f) => Number.isInteger(Math.log10(f)))
  for (const f of splits) {
    if (kept.every((each) => Math.abs(place(each) - place(f)) >= LABEL_PX)) kept.push(f)
  }
  return splits.map((f) => (kept.includes(f) ? f : null))
}

function shade(plot: uPlot, band: [number, number] | null, color: string): void {
  if (!band) return
  const { ctx, bbox } = plot
  const inside = (x: number) => Math.min(Math.max(x, bbox.left), bbox.left + bbox.width)
  const from = inside(plot.valToPos(band[0], 'x', true))
  const to = inside(plot.valToPos(band[1], 'x', true))
  ctx.save()
  ctx.fillStyle = color
  ctx.globalAlpha = 0.6
  ctx.fillRect(from, bbox.top, to - from, bbox.height)
  ctx.restore()
}

function drawMarkers(plot: uPlot, markers: Marker[], named: boolean): void {
  const { ctx, bbox } = plot
  ctx.save()
  ctx.lineWidth = 1.5 * devicePixelRatio
  ctx.textAlign = 'left'
  ctx.textBaseline = 'alphabetic'
  ctx.font = `bold ${13 * devicePixelRatio}px sans-serif`
  const labels: number[] = []
  for (const marker of markers) {
    const x = plot.valToPos(marker.frequency, 'x', true)
    if (x < bbox.left || x > bbox.left + bbox.width) continue
    ctx.strokeStyle = marker.color
    ctx.setLineDash([6, 4])
    ctx.beginPath()
    ctx.moveTo(x, bbox.top)
    ctx.lineTo(x, bbox.top + bbox.height)
    ctx.stroke()
    if (!named) continue
    ctx.fillStyle = marker.color
    // Labels that would lie on each other stand in rows.
    const row = labels.filter((each) => Math.abs(each - x) < 28 * devicePixelRatio).length
    labels.push(x)
    ctx.fillText(marker.label, x + 4, bbox.top + (14 + 16 * row) * devicePixelRatio)
  }
  ctx.restore()
}
