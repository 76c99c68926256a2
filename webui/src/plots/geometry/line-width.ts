/** Width of a curve that the eye can follow point by point, in CSS pixels. */
const WIDE = 1.5
/** Points of all curves together from which on a wider line would take too long. */
const DENSE = 2000

/**
 * Width of curves with so many points in all, in CSS pixels.
 *
 * Where no graphics processor helps, lines as thin as one pixel of the screen are drawn twenty
 * times faster than wider ones, for which every bend is worked out; dense ones fill their place
 * anyhow. Screens of two pixels or more for one of CSS are spared the hair line.
 */
export function lineWidth(points: number, ratio: number): number {
  return points < DENSE ? WIDE : Math.max(1, Math.floor(ratio)) / ratio
}
