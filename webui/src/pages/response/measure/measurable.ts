const PROFILE_VELOCITY = 3
const CYCLIC = [8, 9, 10]

/** How an axis can be given a setpoint with every cycle of its bus. */
export interface Measurable {
  possible: boolean
  /** By its profile velocity, as it has no cyclic mode (DS_C over CANopen). */
  bySpeed: boolean
  /** Cycle of the exchange that is started where none runs: a slow CAN carries fewer. */
  cycleMs: number
}

/** By the bus with process data, if any, and the modes of the drive. */
export function measurable(url: string | null, modes: readonly number[]): Measurable {
  if (url === null) return { possible: false, bySpeed: false, cycleMs: 1 }
  const cyclic = CYCLIC.some((mode) => modes.includes(mode))
  const bySpeed = !cyclic && url.startsWith('canopen:') && modes.includes(PROFILE_VELOCITY)
  return { possible: cyclic || bySpeed, bySpeed, cycleMs: cycleMs(url) }
}

function cycleMs(url: string): number {
  const bitrate = url.startsWith('canopen:') ? /[?&]bitrate=(\d+)/.exec(url) : null
  return bitrate ? Math.min(10, Math.max(1, Math.ceil(1e6 / Number(bitrate[1])))) : 1
}
