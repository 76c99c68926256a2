import type { ImportedAxis, ImportedFacts, Sweep } from '../results'
import type { paths, RecordingPreview } from '../../../api/schema'

type Query = paths['/api/v1/measurements/import']['post']['parameters']['query']

export const INPUT_UNITS = [
  'A', 'mA', 'Nm', 'mNm', 'rated', 'percent', 'permille', 'rad/s', 'rpm', '1',
] as const // prettier-ignore
export const OUTPUT_UNITS = [
  'rad/s', 'rpm', 'rev/s', 'deg/s', 'm/s', 'rad', 'rev', 'deg', '1',
] as const // prettier-ignore
export const STRUCTURES = ['unknown', 'motor_speed', 'load_speed', 'speed_loop'] as const
export const TIME_UNITS = ['s', 'ms', 'us', 'ns'] as const

/** What somebody says of a recording; columns by number. */
export interface Said {
  time: string | null
  time_unit: (typeof TIME_UNITS)[number]
  sample_rate_hz: number | null
  input: string
  output: string
  input_unit: NonNullable<Query['input_unit']>
  output_unit: NonNullable<Query['output_unit']>
  rated_torque_nm: number | null
  torque_constant_nm_a: number | null
  structure: NonNullable<Query['structure']>
  f_min_hz: number | null
  f_max_hz: number | null
  output_filter_hz: number | null
  current_bandwidth_hz: number | null
  loop_delay_s: number | null
}

/** A first choice, from what rises and from names; a person looks at it before anything is done. */
export function guessed(found: RecordingPreview): Said {
  const rising = found.columns.find((each) => each.rises)
  const others = found.columns.filter((each) => each !== rising)
  const by = (pattern: RegExp) => others.find((each) => pattern.test(each.name))
  const first = by(/torq|curr|iq|moment|strom|转矩|电流/i) ?? others[0]
  const second =
    others.find(
      (each) => each !== first && /speed|veloc|omega|drehzahl|速度|转速/i.test(each.name),
    ) ?? others.find((each) => each !== first)
  const unit = rising?.unit
  return {
    time: rising ? String(rising.number) : null,
    time_unit: TIME_UNITS.find((each) => each === unit) ?? 's',
    sample_rate_hz: null,
    input: String(first?.number ?? 1),
    output: String(second?.number ?? first?.number ?? 1),
    input_unit: '1',
    output_unit: '1',
    rated_torque_nm: null,
    torque_constant_nm_a: null,
    structure: 'unknown',
    f_min_hz: null,
    f_max_hz: null,
    output_filter_hz: null,
    current_bandwidth_hz: null,
    loop_delay_s: null,
  }
}

/** What an import says of itself; null for measurements of our own. */
export const importedOf = (sweep: Sweep): ImportedFacts | null => sweep.imported ?? null
export const axisOf = (sweep: Sweep): ImportedAxis | null => sweep.axis ?? null

/** Whether time is stated, without which nothing can be evaluated. */
export const statable = (said: Said): boolean => said.time !== null || said.sample_rate_hz !== null
