import type { LoadSideResult } from '../../../../api/schema'
import { figureRow, type ShownNote, type ShownRow, type Text } from '../form/shown'
import { engineering } from '../../steps/steps'

const TONES: Partial<Record<string, ShownNote['tone']>> = {
  measured: 'good',
  backlash_not_seen: 'good',
  flank_kept: 'warn',
}
const ORDERS = 6

/** The verdict first, as `backend/tools/mechanics/load_side/texts.py` has it. */
export function loadSideNotes(result: LoadSideResult, text: Text): ShownNote[] {
  return result.findings.map((each) => ({
    words: text(`finding.${each.code}`, {
      value: each.value == null ? '' : engineering(each.value),
      unit: each.unit ?? '',
    }),
    tone: TONES[each.code] ?? 'info',
  }))
}

/** The figures; null is what cannot be known. */
export function loadSideRows(result: LoadSideResult, text: Text): ShownRow[] {
  const least = result.stiffness_at_least_nm_per_rad
  const stiffness =
    least === null
      ? figureRow(text, 'stiffness', result.stiffness_nm_per_rad, 'N·m/rad')
      : { name: text('stiffness_least'), value: least, unit: 'N·m/rad', ends: null }
  return [
    figureRow(text, 'backlash', result.backlash_deg, '°'),
    figureRow(text, 'backlash_motor', result.backlash_motor_rev, 'rev'),
    figureRow(text, 'lost_motion', result.lost_motion_deg, '°'),
    stiffness,
    figureRow(text, 'locked_motor', result.locked_motor_hz, 'Hz'),
    figureRow(text, 'load_inertia', result.load_inertia_kgm2, 'kg·m²'),
    figureRow(text, 'error_span', result.error_span_deg, '°'),
    ...result.error_orders.slice(0, ORDERS).map((each) => ({
      name: text('order', { order: String(each.order_per_rev) }),
      value: each.amplitude_deg,
      unit: '°',
      ends: each.amplitude_ci95_deg,
    })),
    { name: text('counts'), value: result.counts_per_load_rev, unit: '', ends: null },
  ]
}
