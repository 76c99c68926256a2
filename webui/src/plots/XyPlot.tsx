import { useMemo, useRef } from 'react'
import { figure } from '../widgets/numbers/format'
import { sheetOf, upwards, useDrawing } from './canvas'
import { useSharedCursor } from './shared-cursor'
import { range, ticks } from './geometry/ticks'
import { nearestPoint, pointAt, type Range } from './geometry/xy-points'

const LEFT = 62
const BOTTOM = 40
const TOP = 10
const RIGHT = 12

/**
 * One quantity over another, both with a scale of their own. What is pointed at is a moment: others
 * see it at the same time, whatever they have put across and up.
 */
export function XyPlot({
  x,
  y,
  times,
  xLabel,
  yLabel,
  label,
  color,
  dark,
}: {
  x: number[]
  y: number[]
  /** When each point was, in ascending order. */
  times: number[]
  xLabel: string
  yLabel: string
  label: string
  color: string
  dark: boolean
}) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const over = useRef<HTMLDivElement>(null)
  const curve = useMemo(() => ({ x, y, times, xs: range(x), ys: range(y) }), [x, y, times])
  useDrawing(canvas, (element) => drawXy(element, { ...curve, xLabel, yLabel, color }), [
    curve,
    xLabel,
    yLabel,
    color,
    dark,
  ])
  const size = () => ({
    width: over.current?.clientWidth ?? 0,
    height: over.current?.clientHeight ?? 0,
  })
  useSharedCursor(over, 'scope', {
    read: (left, top) => {
      const nearest = nearestPoint(curve, size(), left, top)
      return nearest === null ? null : { x: times[nearest] as number, y: null }
    },
    place: (at) => pointAt(curve, size(), at.x),
  })
  return (
    <div className="xy-plot">
      <canvas ref={canvas} role="img" aria-label={label} />
      <div
        ref={over}
        className="over"
        style={{ inset: `${TOP}px ${RIGHT}px ${BOTTOM}px ${LEFT}px` }}
      />
    </div>
  )
}

interface Drawing {
  x: number[]
  y: number[]
  xs: Range
  ys: Range
  xLabel: string
  yLabel: string
  color: string
}

function drawXy(canvas: HTMLCanvasElement, drawing: Drawing): void {
  const sheet = sheetOf(canvas)
  if (!sheet) return
  const { ctx, width, height, style } = sheet
  const [x0, x1] = drawing.xs
  const [y0, y1] = drawing.ys
  const px = (value: number) => LEFT + ((value - x0) / (x1 - x0)) * (width - LEFT - RIGHT)
  const py = (value: number) =>
    height - BOTTOM - ((value - y0) / (y1 - y0)) * (height - BOTTOM - TOP)
  ctx.strokeStyle = style.getPropertyValue('--line')
  ctx.fillStyle = style.getPropertyValue('--dim')
  ctx.lineWidth = 1
  ctx.textAlign = 'center'
  for (const value of ticks(x0, x1, (width - LEFT) / 90)) {
    rule(ctx, px(value), TOP, px(value), height - BOTTOM)
    ctx.fillText(figure(value, 5), px(value), height - BOTTOM + 15)
  }
  ctx.fillText(drawing.xLabel, (LEFT + width) / 2, height - 6)
  ctx.textAlign = 'right'
  for (const value of ticks(y0, y1, (height - BOTTOM) / 40)) {
    rule(ctx, LEFT, py(value), width - RIGHT, py(value))
    ctx.fillText(figure(value, 5), LEFT - 5, py(value) + 4)
  }
  upwards(ctx, drawing.yLabel, 12, (height - BOTTOM) / 2)
  ctx.strokeStyle = drawing.color
  ctx.lineWidth = 1.5
  ctx.beginPath()
  for (const [i, value] of drawing.x.entries()) {
    ctx.lineTo(px(value), py(drawing.y[i] as number))
  }
  ctx.stroke()
}

function rule(ctx: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  ctx.beginPath()
  ctx.moveTo(x0, y0)
  ctx.lineTo(x1, y1)
  ctx.stroke()
}
