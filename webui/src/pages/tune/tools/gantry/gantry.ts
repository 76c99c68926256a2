import type { AxisState, DriveSummary, GantryResult, GantryValue } from '../../../../api/schema'
import type { ShownNote, ShownRow, Text } from '../form/shown'
import { type Check, engineering, preChecks } from '../../steps/steps'

interface ShownCurve {
  label: string
  x: number[]
  y: number[]
  low: number[]
  high: number[]
}

/** Cyclic velocity, in which both axes are moved. */
const CSV = 9

/** Another axis, and what keeps it from being the partner; null: nothing. */
export interface Candidate {
  id: string
  name: string
  missing: Check | 'segment' | null
}

/** The EtherCAT segment of a drive; null where it has none. */
const segmentOf = (drive: DriveSummary): string | null =>
  drive.ports.find((port) => port.kind === 'ethercat')?.url ?? null

/** All other axes, those first that may be the partner. */
export function candidatesOf(
  drive: DriveSummary,
  others: readonly [DriveSummary, AxisState | null][],
): Candidate[] {
  const segment = segmentOf(drive)
  const found = others
    .filter(([other]) => other.id !== drive.id)
    .map(([other, state]): Candidate => {
      const { id, name } = other
      if (segment === null || segmentOf(other) !== segment) return { id, name, missing: 'segment' }
      const possible = state?.modes.includes(CSV) ?? false
      // The exchange of the segment is that of the axis of this page.
      const checks = preChecks(other, state, { possible, running: true })
      return { id, name, missing: checks.find((each) => !each.ok) ?? null }
    })
  return [...found.filter((each) => !each.missing), ...found.filter((each) => each.missing)]
}

/** As `backend/tools/tuning/gantry/texts.py` has them. */
const TONES: Partial<Record<string, ShownNote['tone']>> = {
  not_coupled: 'warn',
  square: 'good',
  out_of_square: 'warn',
  square_uncertain: 'warn',
  pair_sound: 'good',
  pair_margin_low: 'warn',
  pair_unstable: 'fault',
  margins_beyond_band: 'warn',
}

/** The verdict first, then what else was found. */
export function gantryNotes(result: GantryResult, text: Text): ShownNote[] {
  return result.findings.map((each) => {
    const values = { ...each.values }
    if (each.code === 'out_of_square') values.way = values.way ? `(${values.way})` : ''
    return { words: text(`finding.${each.code}`, values), tone: TONES[each.code] ?? 'info' }
  })
}

/** No digit is shown below a hundredth of the interval: 0 instead of −2·10⁻⁵ within ±0.1. */
function rounded({ value, ci95 }: GantryValue): number {
  const step = ((ci95[1] ?? 0) - (ci95[0] ?? 0)) / 200
  return step > 0 && Math.abs(value) < step ? 0 : value
}

/** The figures with their intervals; null is what cannot be known. */
export function gantryRows(result: GantryResult, text: Text): ShownRow[] {
  const row = (
    name: string,
    found: GantryValue | null,
    unit: string,
    places: Record<string, string> = {},
  ): ShownRow => ({
    name: text(name, places),
    value: found && rounded(found),
    unit,
    ends: found?.ci95 ?? null,
  })
  const plain = (
    name: string,
    value: number | null,
    unit: string,
    places: Record<string, string> = {},
  ): ShownRow => ({ name: text(name, places), value, unit, ends: null })
  const each = (name: string, both: readonly GantryValue[]) =>
    both.map((found, at) => row(name, found, '%', { axis: String(at + 1) }))
  const { margins } = result
  return [
    row('fight', result.fight_percent, '%'),
    row('square_rev', result.out_of_square_rev, 'rev'),
    ...(result.out_of_square_mm ? [row('square_mm', result.out_of_square_mm, 'mm')] : []),
    plain('skew', result.largest_skew_rev, 'rev'),
    ...each('holding', result.holding_percent),
    ...each('friction', result.friction_percent),
    row('stiffness', result.skew_stiffness_nm_per_rad, 'N·m/rad'),
    row('inertia', result.inertia_kgm2, 'kg·m²'),
    ...result.modes.map((mode) => ({
      name: text(`mode.${mode.kind}`, { damping: engineering(100 * mode.damping) }),
      value: mode.frequency_hz,
      unit: 'Hz',
      ends: mode.frequency_ci95_hz,
    })),
    ...(margins?.stable == null
      ? [plain('ms', null, '')]
      : [
          { ...plain('ms', margins.ms, ''), ends: margins.ms_ci95 },
          ...margins.ms_alone.map((alone, at) =>
            plain('ms_alone', alone, '', { axis: String(at + 1) }),
          ),
          plain('phase_margin', margins.phase_margin_deg, '°'),
          plain('factor', result.gain_factor, ''),
        ]),
  ]
}

/** The motion alike and the skew: magnitude in dB with its band. */
export function motionCurves(result: GantryResult, text: Text): ShownCurve[] {
  return result.motions.map((motion) =>
    banded(text(`motion.${motion.kind}`), result, motion.magnitude_db, motion.half_db),
  )
}

/** How much of the coupling of one rigid body there is, over frequency. */
export function couplingCurve(result: GantryResult, text: Text): ShownCurve {
  const curve = banded(text('coupling'), result, result.coupling, result.coupling_half)
  // A ratio of magnitudes has no negative values.
  return { ...curve, low: curve.low.map((value) => Math.max(value, 0)) }
}

function banded(
  label: string,
  result: GantryResult,
  y: readonly number[],
  half: readonly number[],
): ShownCurve {
  return {
    label,
    x: [...result.frequency_hz],
    y: [...y],
    low: y.map((value, at) => value - (half[at] ?? 0)),
    high: y.map((value, at) => value + (half[at] ?? 0)),
  }
}
