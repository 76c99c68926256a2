export type Range = [number, number]

/** A curve of one quantity over another, with what its scales show. */
export interface XyCurve {
  x: ArrayLike<number>
  y: ArrayLike<number>
  /** When each point was, ascending. */
  times: ArrayLike<number>
  xs: Range
  ys: Range
}

export interface Size {
  width: number
  height: number
}

const placeOf = ({ x, y, xs, ys }: XyCurve, { width, height }: Size, i: number) => ({
  left: (((x[i] as number) - xs[0]) / (xs[1] - xs[0])) * width,
  top: (1 - ((y[i] as number) - ys[0]) / (ys[1] - ys[0])) * height,
})

/**
 * The point of the curve that lies nearest to a place on the drawing; null without any point. Of
 * points at one place (the axis is at standstill) it is the last, which is what others have in
 * sight as well.
 */
export function nearestPoint(curve: XyCurve, size: Size, left: number, top: number): number | null {
  let found: number | null = null
  let least = Number.POSITIVE_INFINITY
  for (let i = 0; i < curve.times.length; i++) {
    const at = placeOf(curve, size, i)
    const away = (at.left - left) ** 2 + (at.top - top) ** 2
    if (away <= least) [found, least] = [i, away]
  }
  return found
}

/** Where the curve was at a time; null where that is not of the drawn stretch. */
export function pointAt(
  curve: XyCurve,
  size: Size,
  time: number,
): { left: number; top: number } | null {
  const { times } = curve
  const last = times.length - 1
  if (last < 0 || time < (times[0] as number) || time > (times[last] as number)) return null
  let [low, high] = [0, last]
  while (low < high) {
    const middle = (low + high) >> 1
    if ((times[middle] as number) < time) low = middle + 1
    else high = middle
  }
  const before = Math.max(low - 1, 0)
  const nearer = time - (times[before] as number) < (times[low] as number) - time ? before : low
  return placeOf(curve, size, nearer)
}
