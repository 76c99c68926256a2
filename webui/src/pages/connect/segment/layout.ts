import type { SegmentStation } from '../../../api/schema'

/** What a cable is like: whole, whole with counted errors, broken, or behind a broken one. */
type CableState = 'good' | 'errors' | 'broken' | 'beyond'

/** A station in the picture: column from the computer, row of its branch, cable before it. */
export interface Place {
  station: SegmentStation
  column: number
  row: number
  parentRow: number
  cable: CableState
  /** What the counters of both ends of the cable accuse. */
  findings: string[]
}

/** Places of all stations; the computer stands at column 0, row 0. */
export function places(stations: SegmentStation[]): Place[] {
  const placed = new Map<number, Place>()
  const taken = new Set<number>()
  let rows = 1
  for (const station of stations) {
    const parent = placed.get(station.behind_station)
    const parentRow = parent?.row ?? 0
    // The first one behind a station goes on in its row, every other begins a branch.
    const first = !taken.has(station.behind_station)
    taken.add(station.behind_station)
    const findings = [
      ...(parent?.station.ports[station.behind_port]?.findings ?? []),
      ...(station.ports[0]?.findings ?? []),
    ]
    placed.set(station.station, {
      station,
      column: (parent?.column ?? 0) + 1,
      row: first ? parentRow : rows++,
      parentRow,
      cable: cable(station, parent?.station, findings),
      findings: [...new Set(findings)],
    })
  }
  return [...placed.values()]
}

function cable(
  station: SegmentStation,
  parent: SegmentStation | undefined,
  findings: string[],
): CableState {
  if (parent && !parent.answers) return 'beyond'
  if (!station.answers) return 'broken'
  return findings.length > 0 ? 'errors' : 'good'
}

/** Bars of the histogram without the empty ones at its end. */
export function shownBins<Bin extends { count: number }>(bins: Bin[]): Bin[] {
  const last = bins.findLastIndex((bin) => bin.count > 0)
  return bins.slice(0, Math.max(last + 1, 1))
}

/** Height of a bar, 0 to 1: single late cycles must be seen next to a million punctual ones. */
export function barHeight(count: number, most: number): number {
  return count <= 0 ? 0 : Math.log10(count + 1) / Math.log10(most + 1)
}
