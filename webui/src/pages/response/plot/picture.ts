import { type Curve, gridOf, hertz, logTicks, partOf, rangeOf } from './bode'

const WIDTH = 960
const LEFT = 64
const RIGHT = 16
const PARTS = [
  { part: 'magnitude', label: 'dB', top: 48, height: 260, step: 10 },
  { part: 'phase', label: '°', top: 328, height: 200, step: 45 },
] as const
const HEIGHT = 600

/** A Bode plot as a file of its own, on white, for reports. */
export function bodeSvg(
  curves: Curve[],
  title: string,
  unit: string,
  band: [number, number] | null,
): string {
  const grid = gridOf(curves)
  const from = grid[0] ?? 1
  const to = grid.at(-1) ?? 10
  const x = (f: number) =>
    LEFT + ((WIDTH - LEFT - RIGHT) * Math.log(f / from)) / Math.log(to / from || 10)
  const parts: string[] = []
  for (const { part, label, top, height, step } of PARTS) {
    const [low, high] = rangeOf(curves, part, [from, to])
    const y = (v: number) => top + height * (1 - (v - low) / (high - low))
    if (band) {
      const [a, b] = [x(Math.max(band[0], from)), x(Math.min(band[1], to))]
      parts.push(rect(a, top, Math.max(0, b - a), height, '#eaf3f9'))
    }
    for (const f of logTicks(from, to)) {
      parts.push(line(x(f), top, x(f), top + height))
      if (part === 'phase') parts.push(text(x(f), top + height + 18, hertz(f)))
    }
    for (let v = low; v <= high; v += step * (high - low > 12 * step ? 2 : 1)) {
      parts.push(line(LEFT, y(v), WIDTH - RIGHT, y(v)))
      parts.push(text(LEFT - 6, y(v) + 4, `${v}`.replace('-', '−'), 'end'))
    }
    parts.push(
      text(LEFT + 6, top + 16, part === 'magnitude' ? `${label} (${unit})` : label, 'start'),
    )
    for (const curve of curves) {
      const points = curve.frequency.map((f, i) => [f, partOf(curve, part).values[i]] as const)
      parts.push(path(points, x, y, curve))
    }
  }
  const legend = curves.map((curve, i) =>
    [
      rect(LEFT + i * 230, 574, 18, 4, curve.color),
      text(LEFT + 24 + i * 230, 580, curve.label, 'start'),
    ].join(''),
  )
  return [
    `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${WIDTH} ${HEIGHT}" width="${WIDTH}" height="${HEIGHT}" font-family="sans-serif" font-size="13">`,
    rect(0, 0, WIDTH, HEIGHT, '#ffffff'),
    `<text x="${LEFT}" y="30" font-size="17" font-weight="bold">${escaped(title)}</text>`,
    ...parts,
    ...legend,
    '</svg>',
  ].join('\n')
}

function path(
  points: (readonly [number, number | null | undefined])[],
  x: (f: number) => number,
  y: (v: number) => number,
  curve: Curve,
): string {
  let open = false
  const steps: string[] = []
  for (const [f, value] of points) {
    if (value === null || value === undefined || !Number.isFinite(value)) {
      open = false
      continue
    }
    steps.push(`${open ? 'L' : 'M'}${x(f).toFixed(1)} ${y(value).toFixed(1)}`)
    open = true
  }
  const dash = curve.dashed ? ' stroke-dasharray="6 4"' : ''
  return `<path d="${steps.join('')}" fill="none" stroke="${curve.color}" stroke-width="1.8"${dash}/>`
}

const rect = (x: number, y: number, width: number, height: number, fill: string) =>
  `<rect x="${x.toFixed(1)}" y="${y}" width="${width.toFixed(1)}" height="${height}" fill="${fill}"/>`
const line = (x0: number, y0: number, x1: number, y1: number) =>
  `<line x1="${x0.toFixed(1)}" y1="${y0.toFixed(1)}" x2="${x1.toFixed(1)}" y2="${y1.toFixed(1)}" stroke="#d0d7de"/>`
const text = (x: number, y: number, words: string, anchor = 'middle') =>
  `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}">${escaped(words)}</text>`
const escaped = (words: string) =>
  words.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;')

/** The picture as pixels, twice as fine. Rejects where the browser cannot draw it. */
export async function toPng(svg: string): Promise<Blob> {
  const picture = new Image()
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`
  await picture.decode()
  const canvas = document.createElement('canvas')
  canvas.width = WIDTH * 2
  canvas.height = HEIGHT * 2
  canvas.getContext('2d')?.drawImage(picture, 0, 0, canvas.width, canvas.height)
  return new Promise((resolve, reject) =>
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('PNG'))), 'image/png'),
  )
}
