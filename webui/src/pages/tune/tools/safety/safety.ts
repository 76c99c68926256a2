import type { SafetyResult } from '../../../../api/schema'
import type { ShownNote, ShownRow, Text } from '../form/shown'
import { engineering } from '../../steps/steps'

/** The verdict first, as `backend/tools/watching/safety_check/texts.py` has it; always that it is no certificate. */
export function notesOf(result: SafetyResult, text: Text): ShownNote[] {
  const { verdict, obstacle, sign, signature } = result
  const speed =
    verdict === 'power_off_at_speed'
      ? Math.abs(result.speed_at_torque_free_rpm ?? 0)
      : (result.highest_rpm ?? 0)
  const tone = verdict === 'within_limits' ? 'good' : verdict === 'recorded' ? 'info' : 'warn'
  const words = text(`verdict.${result.function}.${verdict}`, { value: engineering(speed) })
  const found: ShownNote[] = [{ words, tone }]
  for (const each of result.exceeded ?? []) {
    found.push({ words: text(`exceeded.${each}`), tone: 'warn' })
  }
  if (obstacle) {
    const number =
      obstacle === 'too_slow' ? Math.abs(result.speed_rpm ?? 0) : result.torque_before_percent
    const value = engineering(number ?? 0)
    found.push({ words: text(`obstacle.${obstacle}`, { value }), tone: 'warn' })
  }
  found.push({ words: text('no_certificate'), tone: 'warn' })
  if (sign) found.push({ words: text(`sign.${sign}`), tone: 'info' })
  const faults = (result.reports ?? []).join(', ')
  if (faults) found.push({ words: text('reports', { faults }), tone: 'info' })
  const { device, person } = result
  const at = moment(result.measured_at)
  found.push({
    words: text('made', { device: device || '–', person: person || '–', at }),
    tone: 'info',
  })
  if (!signature) return [...found, { words: text('unsigned'), tone: 'warn' }]
  const values = {
    person: signature.person,
    at: moment(signature.signed),
    sha256: signature.sha256,
    notes: signature.notes ?? '',
  }
  found.push({ words: text('signed', values), tone: 'info' })
  if (!signature.intact) found.push({ words: text('signature_broken'), tone: 'warn' })
  return found
}

const moment = (iso: string) => iso.slice(0, 19).replace('T', ' ')

/** What was recorded; null is what could not be shown. */
export function rowsOf(result: SafetyResult, text: Text): ShownRow[] {
  const torque = result.function === 'sto' || result.function === 'ss1'
  const row = (name: string, value: number | null | undefined, unit: string) => ({
    name: text(name),
    value: value ?? null,
    unit,
  })
  return [
    row('speed', result.speed_rpm, 'rpm'),
    ...(torque ? [row('torque_free', result.torque_free_ms, 'ms')] : []),
    row('stop_time', result.stop_ms, 'ms'),
    row('stop_distance', result.stop_rev, 'rev'),
    ...(torque
      ? [
          row('torque_before', result.torque_before_percent, '%'),
          row('torque_after', result.torque_after_percent, '%'),
          row('torque_noise', result.torque_noise_percent, '%'),
          row('speed_at_free', result.speed_at_torque_free_rpm, 'rpm'),
        ]
      : []),
    row('highest', result.highest_rpm, 'rpm'),
    ...(result.limited_rpm == null ? [] : [row('limited', result.limited_rpm, 'rpm')]),
    row('watched', result.watched_ms, 'ms'),
  ]
}
