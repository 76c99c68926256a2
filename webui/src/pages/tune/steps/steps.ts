import type { AxisState, DriveSummary, MessageInfo } from '../../../api/schema'

/** One thing that must be right before an axis is tuned. */
export interface Check {
  name: 'answers' | 'control' | 'faults' | 'idle' | 'pending' | 'cyclic' | 'exchange'
  ok: boolean
  /** What is in the way, as the drive or the server says it. */
  detail: string
  message?: MessageInfo | null
  /** Nothing is in the way of measuring; it is only good to know. */
  optional?: boolean
}

/** What the server will insist on, reported before the button is pressed. */
export function preChecks(
  drive: DriveSummary,
  state: AxisState | null,
  cyclic: { possible: boolean; running: boolean },
): Check[] {
  const { holder, mine } = drive.lease
  return [
    {
      name: 'answers',
      ok: state?.fresh === true,
      detail: state?.problem ?? '',
      message: state?.problem_message ?? null,
    },
    { name: 'control', ok: mine || holder === null, detail: mine ? '' : (holder ?? '') },
    {
      name: 'faults',
      ok: (state?.faults ?? []).every((each) => each.kind !== 'fault'),
      detail: (state?.faults ?? []).map((each) => each.name).join(', '),
    },
    { name: 'idle', ok: state?.moving_job == null, detail: '' },
    {
      name: 'pending',
      ok: drive.pending === 0,
      detail: drive.pending ? String(drive.pending) : '',
    },
    { name: 'cyclic', ok: cyclic.possible, detail: '' },
    // Where there can be no exchange, none could be started either.
    ...(cyclic.possible
      ? [{ name: 'exchange' as const, ok: cyclic.running, detail: '', optional: true }]
      : []),
  ]
}

/** Whether a measurement may be asked for. */
export const ready = (checks: Check[]): boolean => checks.every((each) => each.ok || each.optional)

/**
 * Whether the step *Pre-checks* is done. While the axis moves it stays so: that another motion has to
 * wait, and needs a consent of its own, is not what the step is about.
 */
export const checked = (checks: Check[], agreed: boolean): boolean =>
  ready(checks.filter((each) => each.name !== 'idle')) &&
  (agreed || checks.some((each) => each.name === 'idle' && !each.ok))

/** Number and count of the steps of a job that counts them; null for others, and before the first. */
export function stepOf(step: MessageInfo): { now: number; of: number } | null {
  const first = step.params?.part0
  if (typeof first === 'object' && first) return stepOf(first)
  const { step: now, steps: of } = step.params ?? {}
  return typeof now === 'number' && typeof of === 'number' ? { now, of } : null
}

/** A value with its unit, `1.23·10⁻⁴ kg·m²`; a dash where there is none. */
export const amount = (value: number | null, unit: string): string =>
  value === null ? '—' : `${engineering(value)}${unit ? ` ${unit}` : ''}`

/** A confidence interval, `1.20·10⁻⁴ … 1.26·10⁻⁴`; empty where there is none. */
export function interval(ends: [number | null, number | null] | null | undefined): string {
  if (!ends) return ''
  return ends.map((each) => (each === null ? '—' : engineering(each))).join(' … ')
}

const SUPERSCRIPT = '⁰¹²³⁴⁵⁶⁷⁸⁹'

/** Three significant digits, powers of ten written as such. */
export function engineering(value: number): string {
  const minus = (text: string) => text.replace(/^-/, '−')
  if (value === 0) return '0'
  const size = Math.abs(value)
  if (size >= 1e-2 && size < 1e5) return minus(String(Number(value.toPrecision(3))))
  const [digits = '', power = '0'] = value.toExponential(2).split('e')
  const sign = power.startsWith('-') ? '⁻' : ''
  const raised = Array.from(power.replace(/^[+-]/, ''))
    .map((d) => SUPERSCRIPT[Number(d)])
    .join('')
  return `${minus(digits)}·10${sign}${raised}`
}
