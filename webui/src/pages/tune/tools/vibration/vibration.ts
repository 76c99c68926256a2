import type { DwellResult, VibrationResult } from '../../../../api/schema'
import {
  figureRow,
  type Ends,
  type ShownNote,
  type ShownRow,
  type ShownTable,
  type Text,
} from '../form/shown'
import { engineering } from '../../steps/steps'

/** As `backend/tools/watching/vibration/texts.py` and `backend/tools/moving/dwell/texts.py` have them. */
const TONES: Partial<Record<string, ShownNote['tone']>> = {
  resonance: 'warn',
  fixed_frequency: 'warn',
  highest_at_end: 'warn',
  not_closer: 'warn',
  uneven_speeds: 'warn',
  samples_lost: 'warn',
  nothing_seen: 'good',
  orders_only: 'good',
  excited: 'good',
  not_seen: 'warn',
  not_linear: 'warn',
  level_changed: 'warn',
  blocks_lost: 'warn',
}
const SHOWN = 8

/** The verdict first, then what limits it. */
export function vibrationNotes(
  findings: VibrationResult['findings'] | DwellResult['findings'],
  text: Text,
): ShownNote[] {
  return findings.map((each) => ({
    words: text(`finding.${each.code}`, {
      value: each.value == null ? '' : engineering(each.value),
      unit: each.unit ?? '',
    }),
    tone: TONES[each.code] ?? 'info',
  }))
}

/** Resonances and fixed frequencies with their intervals. */
export function vibrationRows(result: VibrationResult, text: Text): ShownRow[] {
  const row = (name: string) => (each: { frequency_hz: number; frequency_ci95_hz: Ends }) => ({
    name: text(name),
    value: each.frequency_hz,
    unit: 'Hz',
    ends: each.frequency_ci95_hz,
  })
  return [
    ...result.resonances.map(row('resonance')),
    ...result.frequencies.slice(0, SHOWN).map(row('frequency')),
  ]
}

const range = (ends: readonly number[], digits: number) =>
  ends.map((each) => String(Number(each.toPrecision(digits)))).join('–')

/** Speeds to avoid, and orders with what they may come from. */
export function vibrationTables(result: VibrationResult, text: Text): ShownTable[] {
  const head = (...names: string[]) => names.map((each) => text(`head.${each}`))
  const avoid = result.resonances.flatMap((each) =>
    each.avoid.map((one) => [
      engineering(each.frequency_hz),
      engineering(one.order_per_rev),
      engineering(one.speed_rpm),
      range([one.low_rpm, one.high_rpm], 4),
    ]),
  )
  const orders = result.orders
    .slice(0, SHOWN)
    .map((each) => [
      range([each.order_per_rev], 5),
      range(each.order_ci95, 5),
      engineering(each.largest_rpm),
      engineering(each.torque_percent),
      engineering(each.at_rpm),
      text(`place.${each.place}`),
    ])
  return [
    {
      name: text('head.avoid'),
      head: head('resonance', 'excited_by', 'speed', 'avoid'),
      rows: avoid,
    },
    {
      name: text('head.order'),
      head: head('order', 'interval', 'level', 'torque', 'at', 'place'),
      rows: orders,
    },
  ].filter((table) => table.rows.length > 0)
}

/** The levels of the largest orders over the absolute speed, in order of the speed. */
export function levelCurves(
  result: VibrationResult,
): { label: string; x: number[]; y: number[] }[] {
  return result.orders.slice(0, 4).map((each) => {
    const pairs = each.level_speed_rpm
      .map((speed, at): [number, number] => [speed, each.level_rpm[at] ?? 0])
      .sort((one, other) => one[0] - other[0])
    return {
      label: range([each.order_per_rev], 4),
      x: pairs.map((pair) => pair[0]),
      y: pairs.map((pair) => pair[1]),
    }
  })
}

/** What a dwell excited; null is what cannot be known. */
export function dwellRows(result: DwellResult, text: Text): ShownRow[] {
  return [
    {
      name: text('excitation'),
      value: result.excitation,
      unit: result.by === 'speed' ? 'rpm' : '%',
      ends: null,
    },
    figureRow(text, 'speed', result.speed_rpm, 'rpm'),
    figureRow(text, 'position', result.position_deg, '°'),
    figureRow(text, 'torque', result.torque_percent, '%'),
    figureRow(text, 'phase', result.phase_deg, '°'),
    ...result.harmonics.map((each) => ({
      name: text('harmonic', { multiple: String(each.multiple) }),
      value: each.speed_rpm,
      unit: 'rpm',
      ends: each.speed_ci95_rpm,
    })),
    { name: text('over'), value: result.over_s, unit: 's', ends: null },
  ]
}
