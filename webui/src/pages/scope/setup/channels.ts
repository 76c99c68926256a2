import type { ParameterRow } from '../../../api/schema'
import { isText } from '../../../widgets/numbers/format'
import {
  POSITION_ACTUAL,
  TORQUE_ACTUAL,
  VELOCITY_ACTUAL,
} from '../../../widgets/parameters/objects'
import { storedSetup } from './setup'

export interface Channel {
  drive: string
  key: string
}

/** Distinct also for the colour-blind (after Okabe and Ito), on light and on dark ground. */
export const TRACE_COLORS = {
  light: ['#0072b2', '#c24a00', '#00805e', '#a04a8a', '#80650c', '#2b86b8', '#7a4a3f', '#666666'],
  dark: ['#56b4e9', '#ff9248', '#2fd0a0', '#e79ad0', '#f0d850', '#9fc5ff', '#d0a090', '#b8b8b8'],
}

/** Channels that the Scope page of this browser shows. */
export const storedChannels = (): Channel[] | null =>
  storedSetup()?.traces.map(({ drive, key }) => ({ drive, key })) ?? null

/** What can be drawn: numbers that can be read. */
export const drawable = (row: ParameterRow) =>
  row.access !== 'wo' && row.reachable && !isText(row.type)

/** Position, speed and torque of a drive, as far as it has them. */
export function usualChannels(drive: string, rows: ParameterRow[]): Channel[] {
  return [VELOCITY_ACTUAL, POSITION_ACTUAL, TORQUE_ACTUAL]
    .filter((key) => rows.some((row) => row.key === key && drawable(row)))
    .map((key) => ({ drive, key }))
}
