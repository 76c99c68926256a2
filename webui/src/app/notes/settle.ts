/** How far a page is scrolled, and what room a notice that went left above it; px. */
interface Settled {
  scrolled: number
  left: number
}

/**
 * Where a page is to be scrolled to when what is above it changes its height, so that nothing
 * moves under a finger. `anchored`: what the browser has scrolled for it already. Where there is
 * no way to scroll up, room is left where the notice was; the next notice takes that first.
 */
export function settled(was: Settled, before: number, after: number, anchored = 0): Settled {
  const grown = after - before
  if (grown > 0) {
    const used = Math.min(was.left, grown)
    return { scrolled: was.scrolled + grown - used - anchored, left: was.left - used }
  }
  const up = Math.min(was.scrolled - anchored, -grown)
  return { scrolled: was.scrolled - anchored - up, left: was.left - grown - up }
}
