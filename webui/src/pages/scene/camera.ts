type Point = readonly [number, number, number]

/** Distance of two axes in the scene, as backend/scene/view.py places them (_SPACING). */
const SPACING = 0.9
/** Width to height at which the distances below show everything from side to side. */
const WIDE = 1.25
const FARTHEST = 2.5
/** Distance from which one axis is seen whole in a usual window. */
const CLEAR = 1.4

interface Camera {
  position: Point
  lookAt: Point
}

/**
 * Where the camera begins: before all axes, or before number `place` of `count`. A window of
 * `aspect` (width to height) narrower than usual sees less from side to side, as the angle of view
 * is that of its height: the camera stands farther away then.
 */
export function cameraFor(place: number, count: number, aspect: number): Camera {
  const y = place < 0 ? 0 : (count / 2 - 0.5 - place) * SPACING
  const lookAt: Point = place < 0 ? [0, 0, 0.1] : [-0.2, y, 0.1]
  const from: Point = place < 0 ? [0.3, -2.3, 1.4] : [0, -1.2, 0.85]
  const narrow = Math.min(Math.max(WIDE / aspect, 1), FARTHEST)
  // Before all axes, the nearest must be in sight, too: the more there are the nearer it comes.
  const nearest = ((count - 1) / 2) * SPACING
  const far = place < 0 ? Math.max(narrow, (nearest + CLEAR * narrow) / -from[1]) : narrow
  return {
    position: [lookAt[0] + from[0] * far, lookAt[1] + from[1] * far, lookAt[2] + from[2] * far],
    lookAt,
  }
}

/** As viser's address takes it. */
export const written = (point: Point) => point.map((value) => value.toFixed(3)).join(',')
