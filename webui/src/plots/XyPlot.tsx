import { useEffect, useRef } from 'react'
import { figure } from '../widgets/format'

const LEFT = 62
const BOTTOM = 40
const TOP = 10
const RIGHT = 12

/** One quantity over another, both with a scale of their own. */
export function XyPlot({
  x,
  y,
  xLabel,
  yLabel,
  label,
  color,
  dark,
}: {
  x: number[]
  y: number[]
  xLabel: string
  yLabel: string
  label: string
  color: string
  dark: boolean
}) {
  const canvas = useRef<HTMLCanvasElement>(null)
  useEffect(() => {
    const element = canvas.current
    if (!element) return
    const draw = () => drawXy(element, { x, y, xLabel, yLabel, color })
    draw()
    const observer = new ResizeObserver(draw)
    observer.observe(element)
    return () => observer.disconnect()
  }, [x, y, xLabel, yLabel, color, dark])
  return <canvas ref={canvas} className="xy-plot" role="img" aria-label={label} />
}

interface Drawing {
  x: number[]
  y: number[]
  xLabel: string
  yLabel: string
  color: string
}

function drawXy(canvas: HTMLCanvasElement, drawing: Drawing): void {
  const { clientWidth: width, clientHeight: height } = canvas
  canvas.width = width * devicePixelRatio
  canvas.height = height * devicePixelRatio
  const ctx = canvas.getContext('2d')
  if (!ctx) return
  const style = getComputedStyle(document.documentElement)
  ctx.scale(devicePixelRatio, devicePixelRatio)
  ctx.font = `12px ${getComputedStyle(document.body).fontFamily}`
  const [x0, x1] = range(drawing.x)
  const [y0, y1] = range(drawing.y)
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
  ctx.save()
  ctx.translate(12, (height - BOTTOM) / 2)
  ctx.rotate(-Math.PI / 2)
  ctx.textAlign = 'center'
  ctx.fillText(drawing.yLabel, 0, 0)
  ctx.restore()
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

/** Range with some air, never of no size. */
function range(values: number[]): [number, number] {
  let min = Number.POSITIVE_INFINITY
  let max = Number.NEGATIVE_INFINITY
  for (const value of values) {
    if (value < min) min = value
    if (value > max) max = value
  }
  if (min > max) return [-1, 1]
  const air = (max - min) * 0.05 || Math.abs(max) * 0.1 || 1
  return [min - air, max + air]
}

/** About `count` round values of a range. */
export function ticks(min: number, max: number, count: number): number[] {
  const rough = (max - min) / Math.max(1, count)
  const power = 10 ** Math.floor(Math.log10(rough))
  const step = ([1, 2, 5, 10].find((each) => each * power >= rough) ?? 10) * power
  const found: number[] = []
  for (let n = Math.ceil(min / step); n * step <= max; n++) found.push(n * step)
  return found
}
