/** A stretch of a y scale. */
export interface Span {
  min: number
  max: number
}

/** Room above and below what an automatic scale shows. */
const AIR = 0.08
const WHEEL_ZOOM = 1.25
/**
 * Least height of a scale that follows its samples, as part of the greatest number on it: with less
 * the ticks are nearer to each other than two numbers can be, and the search for them has no end.
 */
export const LEAST_HEIGHT = 1e-11

/** Grows over all that is seen; `span` is null while nothing was. */
export class Extent {
  private min = Number.POSITIVE_INFINITY
  private max = Number.NEGATIVE_INFINITY

  see(value: number): void {
    if (value < this.min) this.min = value
    if (value > this.max) this.max = value
  }

  get span(): Span | null {
    return this.min <= this.max ? { min: this.min, max: this.max } : null
  }
}

/** What an automatic scale shows: all that was seen with some air, never of no height. */
export function withAir(seen: Span | null): Span {
  if (!seen) return { min: -1, max: 1 }
  const least = Math.max(Math.abs(seen.min), Math.abs(seen.max)) * LEAST_HEIGHT
  const air =
    seen.max === seen.min
      ? Math.abs(seen.max) * 0.1 || 1
      : Math.max((seen.max - seen.min) * AIR, least)
  return { min: seen.min - air, max: seen.max + air }
}

/** A scale made `factor` times as high about `centre`. */
export function zoomed({ min, max }: Span, centre: number, factor: number): Span {
  return sound({ min: centre - (centre - min) * factor, max: centre + (max - centre) * factor })
}

/** Factor of one step of a wheel. */
export const wheelFactor = (event: { deltaX: number; deltaY: number }) =>
  // With Shift some browsers turn the wheel sideways.
  (event.deltaY || event.deltaX) > 0 ? WHEEL_ZOOM : 1 / WHEEL_ZOOM

/** Two fingers in one direction: how far apart, and where between the ends their middle lies. */
export interface Pinch {
  apart: number
  /** 0 at the lower end of the span, 1 at its upper one. */
  part: number
}

/** What is between the fingers stays between them: they move the span and stretch it. */
export function pinched({ min, max }: Span, began: Pinch, now: Pinch): Span {
  const held = min + (max - min) * began.part
  const size = (max - min) * (began.apart / Math.max(now.apart, 1))
  return { min: held - size * now.part, max: held + size * (1 - now.part) }
}

export const moved = ({ min, max }: Span, by: number): Span => ({ min: min + by, max: max + by })

/**
 * A span with as many digits as its height deserves, so that the fields show round numbers; of
 * some height, since a scale of none keeps uPlot looking for ticks for ever.
 */
export function sound({ min, max }: Span): Span {
  const size = Math.max(Math.abs(min), Math.abs(max))
  const least = Math.max(size * 1e-9, 1e-12)
  if (!(max - min > least)) {
    const middle = (min + max) / 2
    return { min: middle - least, max: middle + least }
  }
  const step = 10 ** Math.floor(Math.log10((max - min) / 1000))
  const round = (value: number) => Number((Math.round(value / step) * step).toPrecision(12))
  return { min: round(min), max: round(max) }
}
