import type { CycleResult } from '../../../../api/schema'
import type { ShownNote, ShownRow, Text } from '../form/shown'
import { engineering } from '../../steps/steps'

/** What somebody should do something about. */
const WARNS: ReadonlySet<string> = new Set([
  'gaps',
  'peak_beyond',
  'peak_reached',
  'speed_beyond_rated',
  'overload_exceeded',
])

/** The verdict first; then when it trips, what is assumed, and what is not known. */
export function cycleNotes(result: CycleResult, text: Text): ShownNote[] {
  const { heat, verdict } = result
  const ambient = heat ? engineering(heat.ambient_c) : ''
  const [low, high] = (heat?.rise_share ?? []).map((share) => engineering(100 * share))
  const places = { low: low ?? '', high: high ?? '', ambient }
  const tone = verdict === 'endures' ? 'good' : 'warn'
  const found: ShownNote[] = [{ words: text(`verdict.${verdict}`, places), tone }]
  if (heat) {
    if (verdict !== 'endures') found.push({ words: text('rise', places), tone: 'info' })
    const trip = tripOf(heat, ambient, text)
    if (trip) found.push({ words: trip, tone: 'warn' })
    found.push({ words: text('assumed'), tone: 'info' })
  }
  if (result.power) found.push({ words: text('shaft'), tone: 'info' })
  for (const each of result.findings ?? []) {
    found.push({
      words: text(`finding.${each.code}`, {
        value: each.value == null ? '' : engineering(each.value),
        unit: each.unit ?? '',
      }),
      tone: WARNS.has(each.code) ? 'warn' : 'info',
    })
  }
  return found
}

function tripOf(
  heat: NonNullable<CycleResult['heat']>,
  ambient: string,
  text: Text,
): string | null {
  const [earliest, latest] = heat.trip_s
  if (earliest == null) return null
  const low = minutes(earliest)
  if (latest == null || heat.about_s === null) return text('trips.perhaps', { low, ambient })
  const about = minutes(heat.about_s)
  return text('trips.between', { low, high: minutes(latest), about, ambient })
}

const minutes = (seconds: number): string => String(Number((seconds / 60).toPrecision(2)))

/** Figures in the units that engineers compare with a catalogue. */
export function cycleRows(result: CycleResult, text: Text): ShownRow[] {
  const row = (
    name: string,
    value: number | null,
    unit: string,
    ends: ShownRow['ends'] = null,
    values: Record<string, string> = {},
  ): ShownRow => ({ name: text(name, values), value, unit, ends })
  const { rated_torque_nm: rated, power, overload, peak_limit_percent: limit } = result
  const rows = [
    row('period', result.period_s, 's'),
    row('read', result.duration_s, 's'),
    row('rate', result.sample_rate_hz, '/s'),
    row('rms_of_rated', result.rms_percent, '%', result.rms_ci95_percent),
    ...(rated == null ? [] : [row('rms', (rated * result.rms_percent) / 100, 'N·m')]),
    row('peak', result.peak_percent, '%'),
    ...(limit ? [row('peak_of_limit', (100 * result.peak_percent) / limit, '%')] : []),
    row('above_rated', 100 * result.above_rated_share, '%'),
    row('fastest', result.highest_speed_rpm, 'rpm'),
    row('mean_speed', result.mean_speed_rpm, 'rpm'),
  ]
  if (overload) {
    const values = { percent: String(overload.percent), seconds: String(overload.seconds) }
    rows.push(row('i2t', 100 * overload.used_share, '%', null, values))
  }
  if (power) {
    rows.push(
      row('power', power.highest_w, 'W'),
      row('mean_power', power.mean_w, 'W'),
      row('braking_peak', power.highest_braking_w, 'W'),
      row(result.period_s == null ? 'braking_energy_all' : 'braking_energy', power.braking_j, 'J'),
      row('braking_mean', power.braking_mean_w, 'W'),
    )
  }
  if (result.dc_voltage_v) rows.push(row('voltage_high', result.dc_voltage_v[1], 'V'))
  if (result.drive_load_percent != null) {
    rows.push(row('drive_load', result.drive_load_percent, '%'))
  }
  return rows
}
