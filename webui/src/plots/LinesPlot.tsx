import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import { figure } from '../widgets/numbers/format'
import { axisLook } from './geometry/axis'
import { lineWidth } from './geometry/line-width'
import { sharedCursor } from './shared-cursor'

/** A curve over a quantity other than time, with the value beneath the pointer. */
export function LinesPlot({
  x,
  y,
  xLabel,
  yLabel,
  label,
  color,
  dark,
  logarithmic,
}: {
  x: ArrayLike<number>
  y: ArrayLike<number>
  xLabel: string
  yLabel: string
  label: string
  color: string
  dark: boolean
  /** Scale of x. */
  logarithmic: boolean
}) {
  const box = useRef<HTMLDivElement>(null)
  const plotted = useRef<uPlot | null>(null)
  useEffect(() => {
    const element = box.current
    if (!element) return
    const size = () => ({ width: Math.max(200, element.clientWidth), height: 260 })
    const plot = new uPlot(
      options({ xLabel, yLabel, label, color, logarithmic }, size()),
      [[], []],
      element,
    )
    plotted.current = plot
    const observer = new ResizeObserver(() => plot.setSize(size()))
    observer.observe(element)
    return () => {
      observer.disconnect()
      plotted.current = null
      plot.destroy()
    }
  }, [xLabel, yLabel, label, color, dark, logarithmic])
  useEffect(() => {
    // A logarithmic scale has no zero.
    const from = logarithmic ? 1 : 0
    const plot = plotted.current
    if (!plot) return
    for (const each of plot.series) each.width = lineWidth(y.length, devicePixelRatio)
    plot.setData([Array.from(x).slice(from), Array.from(y).slice(from)])
  }, [x, y, xLabel, yLabel, label, color, dark, logarithmic])
  return <div ref={box} className="lines-plot" role="img" aria-label={label} />
}

function options(
  look: { xLabel: string; yLabel: string; label: string; color: string; logarithmic: boolean },
  size: { width: number; height: number },
): uPlot.Options {
  const axis = {
    ...axisLook(),
    values: (_plot: uPlot, splits: number[]) =>
      splits.map((value) => (value === null ? '' : figure(value, 5))),
  }
  return {
    ...size,
    cursor: { drag: { x: true, y: false }, points: { show: true } },
    plugins: [sharedCursor('spectrum')],
    legend: { show: true, live: true },
    scales: {
      // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment -- uPlot.Scale.Distr.Logarithmic, an ambient const enum that cannot be imported
      x: { time: false, ...(look.logarithmic ? { distr: 3 } : {}) },
    },
    axes: [
      { ...axis, label: look.xLabel, size: 34 },
      { ...axis, label: look.yLabel, size: 62 },
    ],
    series: [
      { label: look.xLabel, value: (_plot, value) => figure(value, 6) },
      {
        label: look.label,
        stroke: look.color,
        points: { show: false },
        value: (_plot, value) => figure(value, 5),
      },
    ],
  }
}
