import type { CursorMoved, PeopleHere, PlotCursor } from '../../../api/schema'

export type PlotName = PlotCursor['plot']

/** A place in a plot's data; `y` only where two coordinates are shared. */
export interface Pointed {
  x: number
  y: number | null
}

/** A guest is here, so that pointing has somebody to point for. */
export const isShared = (here: PeopleHere | null): boolean =>
  here?.invitations.some((each) => each.state === 'joined') ?? false

/** Where the others point on a plot, of those who look at the same page. */
export function cursorsOn(
  plot: PlotName,
  page: string,
  here: PeopleHere | null,
  cursors: Iterable<CursorMoved>,
): ({ connection: string; person: string } & Pointed)[] {
  if (!isShared(here)) return []
  const together = new Set(
    here?.people.filter((each) => each.page === page).map((each) => each.connection),
  )
  return [...cursors].flatMap(({ connection, person, plot: on, x, y }) =>
    on === plot && x !== null && together.has(connection)
      ? [{ connection, person, x, y: y ?? null }]
      : [],
  )
}

/** Where on the width of a plot a place in its data lies; beyond an end it is held there. */
export function heldInside(place: number, width: number): { left: number; beyond: -1 | 0 | 1 } {
  if (place < 0) return { left: 0, beyond: -1 }
  if (place > width) return { left: width, beyond: 1 }
  return { left: place, beyond: 0 }
}

/**
 * What this page shows the others about its own pointer. There is one pointer, so the last plot
 * that it entered counts; a picture that runs on beneath a resting pointer moves it as well.
 */
export class Pointing {
  private now: { plot: PlotName; read: () => Pointed | null } | null = null
  private reported: ({ plot: PlotName } & Pointed) | null = null

  constructor(private readonly send: (message: PlotCursor) => void) {}

  /** `read` gives the place in the plot's data, or null where there is none. */
  enter(plot: PlotName, read: () => Pointed | null): void {
    this.now = { plot, read }
  }

  /** Leaving what another plot has adopted already changes nothing. */
  leave(read: () => Pointed | null): void {
    if (this.now?.read === read) this.now = null
  }

  /**
   * Called at the rate at which the others are informed; `shared` is whether they are reported at
   * all.
   */
  tick(shared: boolean): void {
    const at = shared ? (this.now?.read() ?? null) : null
    const plot = at === null ? null : (this.now?.plot ?? null)
    if (this.reported !== null && this.reported.plot !== plot) {
      this.send({ type: 'plot_cursor', plot: this.reported.plot, x: null, y: null })
      this.reported = null
    }
    if (plot === null || at === null) return
    if (at.x === this.reported?.x && at.y === this.reported.y) return
    this.reported = { plot, ...at }
    this.send({ type: 'plot_cursor', plot, ...at })
  }
}
