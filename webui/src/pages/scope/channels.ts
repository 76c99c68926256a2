import type { ParameterRow } from '../../api/schema'
import { isText } from '../../widgets/format'
import { POSITION_ACTUAL, TORQUE_ACTUAL, VELOCITY_ACTUAL } from '../../widgets/objects'

export interface Channel {
  drive: string
  key: string
}

/** Distinct on light and on dark ground, also for the colour-blind (after Okabe and Ito). */
export const TRACE_COLORS = [
  '#0072b2',
  '#d55e00',
  '#009e73',
  '#b5679d',
  '#a8861b',
  '#3a9bd4',
  '#8c564b',
  '#7a7a7a',
]
export const GREATEST_CHANNELS = 16

const STORED = 'servodeck.scope.channels'

export function storedChannels(): Channel[] | null {
  try {
    const found: unknown = JSON.parse(localStorage.getItem(STORED) ?? 'null')
    if (!Array.isArray(found)) return null
    return found.filter(
      (each): each is Channel => typeof each?.drive === 'string' && typeof each?.key === 'string',
    )
  } catch {
    return null
  }
}

export const storeChannels = (channels: Channel[]) =>
  localStorage.setItem(STORED, JSON.stringify(channels))

/** What can be drawn: numbers that can be read. */
export const drawable = (row: ParameterRow) =>
  row.access !== 'wo' && row.reachable && !isText(row.type)

/** Position, speed and torque of a drive, as far as it has them. */
export function usualChannels(drive: string, rows: ParameterRow[]): Channel[] {
  return [VELOCITY_ACTUAL, POSITION_ACTUAL, TORQUE_ACTUAL]
    .filter((key) => rows.some((row) => row.key === key && drawable(row)))
    .map((key) => ({ drive, key }))
}

/** One subscription per drive, since each drive has a time base of its own. */
export function byDrive(channels: Channel[]): Map<string, Channel[]> {
  const found = new Map<string, Channel[]>()
  for (const channel of channels) {
    found.set(channel.drive, [...(found.get(channel.drive) ?? []), channel])
  }
  return found
}
