import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import type { PlotName } from '../../../live/scope/analysis/cursors'
import { axisLook } from '../../../plots/geometry/axis'
import { sharedCursor } from '../../../plots/shared-cursor'
import { figure } from '../../../widgets/numbers/format'

export interface Trace {
  label: string
  color: string
  dashed?: boolean
  time: number[]
  value: number[]
}

/** Answers to a step over time. */
export function StepPlot({
  traces,
  unit,
  label,
  timeLabel,
  dark,
  height = 260,
  shared = 'step',
}: {
  traces: Trace[]
  unit: string
  label: string
  timeLabel: string
  dark: boolean
  height?: number
  /** Name by which people share their cursors on it. */
  shared?: PlotName
}) {
  const box = useRef<HTMLDivElement>(null)
  const plotted = useRef<uPlot | null>(null)
  const shape = JSON.stringify([traces.map((each) => [each.label, each.color]), unit, dark])
  useEffect(() => {
    const element = box.current
    if (!element) return
    const size = () => ({ width: Math.max(200, element.clientWidth), height })
    const plot = new uPlot(
      { ...options(traces, unit, timeLabel, size()), plugins: [sharedCursor(shared)] },
      data(traces),
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
    // Built again only when what is drawn changes in kind.
  }, [shape])
  useEffect(() => {
    plotted.current?.setData(data(traces))
  }, [traces])
  return <div ref={box} className="bode" role="img" aria-label={label} />
}

function data(traces: Trace[]): uPlot.AlignedData {
  const columns = traces.map((each): uPlot.AlignedData => [each.time, each.value])
  return columns.length > 0 ? uPlot.join(columns) : [[]]
}

function options(
  traces: Trace[],
  unit: string,
  timeLabel: string,
  size: { width: number; height: number },
): uPlot.Options {
  const axis = {
    ...axisLook(),
    values: (_plot: uPlot, splits: number[]) => splits.map((value) => figure(value, 5)),
  }
  return {
    ...size,
    legend: { show: false },
    cursor: { drag: { x: false, y: false, setScale: false }, points: { show: false } },
    scales: { x: { time: false } },
    axes: [
      { ...axis, label: timeLabel, size: 34 },
      { ...axis, size: 58, ...(unit ? { label: unit } : {}) },
    ],
    series: [
      {},
      ...traces.map((each) => ({
        label: each.label,
        stroke: each.color,
        width: 1.8,
        points: { show: false },
        ...(each.dashed ? { dash: [6, 4] } : {}),
      })),
    ],
  }
}
