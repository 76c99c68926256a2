import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import { figure } from '../widgets/numbers/format'
import { axisLook } from './geometry/axis'

interface PlottedCurve {
  label: string
  color: string
  x: number[]
  y: (number | null)[]
  /** Ends of a band about it. */
  low?: number[]
  high?: number[]
  /** Marked points instead of a line. */
  points?: boolean
}

/** Curves over a common quantity, each with a band where it has one. */
export function CurvesPlot({
  curves,
  xLabel,
  yLabel,
  label,
  dates = false,
}: {
  curves: PlottedCurve[]
  xLabel: string
  yLabel: string
  label: string
  /** The common quantity is a moment, in seconds since the epoch. */
  dates?: boolean
}) {
  const scheme = useComputedColorScheme('light')
  const box = useRef<HTMLDivElement>(null)
  useEffect(() => {
    const element = box.current
    if (!element) return
    const size = () => ({ width: Math.max(200, element.clientWidth), height: 260 })
    const plot = new uPlot(options(curves, xLabel, yLabel, size(), dates), data(curves), element)
    const observer = new ResizeObserver(() => plot.setSize(size()))
    observer.observe(element)
    return () => {
      observer.disconnect()
      plot.destroy()
    }
  }, [curves, xLabel, yLabel, scheme, dates])
  return <div ref={box} className="lines-plot" role="img" aria-label={label} />
}

/** Columns as uPlot joins them: each curve, then the ends of its band. */
function data(curves: PlottedCurve[]): uPlot.AlignedData {
  return uPlot.join(
    curves.map(({ x, y, low, high }): uPlot.AlignedData =>
      low && high ? [x, y, low, high] : [x, y],
    ),
  )
}

function options(
  curves: PlottedCurve[],
  xLabel: string,
  yLabel: string,
  size: { width: number; height: number },
  dates: boolean,
): uPlot.Options {
  const axis = {
    ...axisLook(),
    values: (_plot: uPlot, splits: number[]) => splits.map((value) => figure(value, 4)),
  }
  const value = (_plot: uPlot, at: number | null) => (at === null ? '—' : figure(at, 4))
  const series: uPlot.Series[] = [{ label: xLabel, ...(dates ? {} : { value }) }]
  const bands: uPlot.Band[] = []
  for (const curve of curves) {
    const at = series.length
    series.push({
      label: curve.label,
      stroke: curve.color,
      width: curve.points ? 0 : 1.8,
      spanGaps: true,
      points: { show: curve.points === true, size: 6, fill: curve.color },
      value,
    })
    if (!curve.low || !curve.high) continue
    const edge = { stroke: 'transparent', spanGaps: true, points: { show: false }, value }
    series.push({ ...edge, label: '2.5 %' }, { ...edge, label: '97.5 %' })
    bands.push({ series: [at + 2, at + 1], fill: `${curve.color}40` })
  }
  return {
    ...size,
    legend: { show: true },
    cursor: { drag: { x: false, y: false, setScale: false } },
    scales: { x: { time: dates } },
    axes: [
      { ...(dates ? axisLook() : axis), label: xLabel, size: 34 },
      { ...axis, label: yLabel, size: 62 },
    ],
    series,
    bands,
  }
}
