import { useRef } from 'react'
import { figure } from '../widgets/numbers/format'
import { sheetOf, upwards, useDrawing } from './canvas'
import { useSharedCursor } from './shared-cursor'
import { ticks } from './geometry/ticks'

const LEFT = 62
const BOTTOM = 40
const TOP = 8
const RIGHT = 78
/** Decibels below the loudest that are still distinguished. */
const RANGE_DB = 70
/** From quiet to loud; each step is lighter than the one before, so it is read without colour. */
const SCALE = [
  [12, 8, 38],
  [66, 10, 104],
  [147, 38, 103],
  [221, 81, 58],
  [252, 165, 10],
  [252, 255, 164],
] as const

/** Loudness over time and frequency, in decibels below the loudest. */
export function HeatMap({
  times,
  origin,
  rows,
  values,
  highest,
  unit,
  label,
  timeLabel,
  valueLabel,
  dark,
}: {
  /** Middle of each column, seconds as they are to be shown. */
  times: number[]
  /** Time of the samples that is shown as zero. */
  origin: number
  rows: number
  /** Column after column, amplitudes. */
  values: Float64Array
  /** Frequency of the last row, Hz. */
  highest: number
  unit: string
  label: string
  timeLabel: string
  valueLabel: string
  dark: boolean
}) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const over = useRef<HTMLDivElement>(null)
  const drawing = { times, rows, values, highest, unit, timeLabel, valueLabel }
  useDrawing(canvas, (element) => drawMap(element, drawing), [...Object.values(drawing), dark])
  const first = times[0] ?? 0
  const long = (times.at(-1) ?? 0) - first || 1
  const wide = () => over.current?.clientWidth ?? 0
  const high = () => over.current?.clientHeight ?? 0
  useSharedCursor(over, 'scope', {
    read: (left, top) =>
      times.length === 0 || wide() === 0 || high() === 0
        ? null
        : {
            x: origin + first + (left / wide()) * long,
            y: Math.max(0, highest * (1 - top / high())),
          },
    place: ({ x, y }) => ({
      left: ((x - origin - first) / long) * wide(),
      // Others may point at the traces, which have no frequency, or see higher ones.
      top: y === null || y > highest ? null : (1 - y / highest) * high(),
    }),
  })
  return (
    <div className="heat-map">
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
  times: number[]
  rows: number
  values: Float64Array
  highest: number
  unit: string
  timeLabel: string
  valueLabel: string
}

function drawMap(canvas: HTMLCanvasElement, drawing: Drawing): void {
  const sheet = sheetOf(canvas)
  if (!sheet || drawing.times.length === 0) return
  const { ctx, width, height, style } = sheet
  const loudest = drawing.values.reduce((a, b) => Math.max(a, b), 0) || 1
  const [wide, high] = [width - LEFT - RIGHT, height - BOTTOM - TOP]
  ctx.imageSmoothingEnabled = false
  ctx.drawImage(image(drawing, loudest), LEFT, TOP, wide, high)
  ctx.fillStyle = style.getPropertyValue('--dim')
  ctx.textAlign = 'center'
  const [first, last] = [drawing.times[0] as number, drawing.times.at(-1) as number]
  for (const time of ticks(first, last, wide / 90)) {
    const x = LEFT + ((time - first) / (last - first || 1)) * wide
    ctx.fillText(figure(time, 5), x, height - BOTTOM + 15)
  }
  ctx.fillText(drawing.timeLabel, LEFT + wide / 2, height - 6)
  ctx.textAlign = 'right'
  for (const hz of ticks(0, drawing.highest, high / 36)) {
    ctx.fillText(figure(hz, 5), LEFT - 5, TOP + high * (1 - hz / drawing.highest) + 4)
  }
  upwards(ctx, drawing.valueLabel, 12, TOP + high / 2)
  legend(ctx, width, high, loudest, drawing.unit)
}

function image(drawing: Drawing, loudest: number): HTMLCanvasElement {
  const { rows, values } = drawing
  const columns = drawing.times.length
  const small = document.createElement('canvas')
  small.width = columns
  small.height = rows
  const ctx = small.getContext('2d')
  const pixels = ctx?.createImageData(columns, rows)
  if (!ctx || !pixels) return small
  for (let column = 0; column < columns; column++) {
    for (let row = 0; row < rows; row++) {
      const value = values[column * rows + row] as number
      const color = shade(1 + (20 * Math.log10(Math.max(value, 1e-12) / loudest)) / RANGE_DB)
      pixels.data.set([...color, 255], 4 * ((rows - 1 - row) * columns + column))
    }
  }
  ctx.putImageData(pixels, 0, 0)
  return small
}

function shade(part: number): [number, number, number] {
  const place = Math.min(1, Math.max(0, part)) * (SCALE.length - 1)
  const step = Math.min(SCALE.length - 2, Math.floor(place))
  const [from, to] = [SCALE[step], SCALE[step + 1]] as [readonly number[], readonly number[]]
  const mixed = from.map((each, i) => each + (place - step) * ((to[i] as number) - each))
  return mixed as [number, number, number]
}

function legend(
  ctx: CanvasRenderingContext2D,
  width: number,
  high: number,
  loudest: number,
  unit: string,
): void {
  const x = width - RIGHT + 10
  for (let i = 0; i < high; i++) {
    const [r, g, b] = shade(1 - i / high)
    ctx.fillStyle = `rgb(${r} ${g} ${b})`
    ctx.fillRect(x, TOP + i, 10, 1)
  }
  ctx.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--dim')
  ctx.textAlign = 'left'
  ctx.fillText(`${figure(loudest, 2)} ${unit}`, x + 13, TOP + 10)
  ctx.fillText(`−${RANGE_DB} dB`, x + 13, TOP + high)
}
