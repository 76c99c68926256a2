import type { Range } from './xy-points'
import { LEAST_HEIGHT } from './yscale'

/** Range with some air, never of no size. */
export function range(values: number[]): Range {
  let min = Number.POSITIVE_INFINITY
  let max = Number.NEGATIVE_INFINITY
  for (const value of values) {
    if (value < min) min = value
    if (value > max) max = value
  }
  if (min > max) return [-1, 1]
  const least = Math.max(Math.abs(min), Math.abs(max)) * LEAST_HEIGHT
  const air = max === min ? Math.abs(max) * 0.1 || 1 : Math.max((max - min) * 0.05, least)
  return [min - air, max + air]
}

/** About `count` round values of a range. */
export function ticks(min: number, max: number, count: number): number[] {
  const rough = (max - min) / Math.max(1, count)
  const power = 10 ** Math.floor(Math.log10(rough))
  const step = ([1, 2, 5, 10].find((each) => each * power >= rough) ?? 10) * power
  const first = Math.ceil(min / step)
  // Beyond this a count of steps has no next one: the loop would have no end.
  if (!Number.isSafeInteger(first) || !Number.isFinite(max)) return []
  const found: number[] = []
  for (let n = first; n * step <= max; n++) found.push(n * step)
  return found
}
