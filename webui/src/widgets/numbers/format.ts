import type { ParameterInfo, Raw } from '../parameters/types'

/** Decimals that a measured quantity is shown with, so that digits do not dance. */
const DECIMALS: Record<string, number> = {
  rev: 4,
  rpm: 1,
  '%': 1,
  V: 1,
  '°C': 1,
  'rpm/s': 0,
  mm: 3,
  '°': 3,
  'mm/s': 2,
  '°/s': 2,
}

/** A live quantity with as many decimals as its unit deserves. */
export function quantity(value: number | null | undefined, unit: string): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '—'
  const text = value.toFixed(DECIMALS[unit] ?? (Number.isInteger(value) ? 0 : 2))
  // Noise around zero must not make the sign flicker.
  return minus(/[1-9]/.test(text) ? text : text.replace('-', ''))
}

/** A figure with about `digits` significant digits and no exponent for usual sizes. */
export function figure(value: number | null | undefined, digits = 5): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '—'
  if (value !== 0 && (Math.abs(value) >= 1e9 || Math.abs(value) < 1e-4)) {
    return minus(value.toExponential(digits - 1))
  }
  return minus(String(Number(value.toPrecision(digits))))
}

const minus = (text: string) => text.replace(/^-(?=[\d.])/, '−')

/** Seconds as `12 s`, `3:05` or `1:02:03`. */
export function duration(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds))
  if (whole < 60) return `${whole} s`
  const hours = Math.floor(whole / 3600)
  const rest = `${hours ? two(Math.floor(whole / 60) % 60) : Math.floor(whole / 60)}:${two(whole % 60)}`
  return hours ? `${hours}:${rest}` : rest
}

const BITS: Record<string, number> = {
  BOOL: 1,
  INT8: 8,
  UINT8: 8,
  INT16: 16,
  UINT16: 16,
  INT32: 32,
  UINT32: 32,
  INT64: 64,
  UINT64: 64,
}

export const isInteger = (type: string) => type in BITS
/** Whether a raw value is a whole number, also one of 64 bits as its digits. */
export const isWhole = (raw: Raw | null, type: string): raw is Raw =>
  isInteger(type) && (typeof raw === 'number' || (raw !== null && /^-?\d+$/.test(raw)))
export const isText = (type: string) => type === 'STRING' || type === 'OCTETS'

/** A raw integer in hexadecimal, two's complement in the width of its type. */
export function hexadecimal(raw: Raw, type: string): string {
  const width = BITS[type] ?? 32
  const whole = BigInt(typeof raw === 'number' ? Math.trunc(raw) : raw)
  return `0x${BigInt.asUintN(width, whole)
    .toString(16)
    .toUpperCase()
    .padStart(Math.ceil(width / 4), '0')}`
}

/** Text of a value as it came from the drive, without unit. */
export function shown(info: ParameterInfo, value: Raw | null, raw: Raw | null): string {
  if (value === null) return '—'
  // A whole number of 64 bits is a text of its digits where a number does not hold it exactly.
  if (typeof value === 'string') return isInteger(info.type) ? minus(value) : value
  if (typeof raw === 'number' && Number.isInteger(raw)) {
    const label = info.enum[String(raw)]
    if (label !== undefined) return `${raw} · ${label}`
  }
  return minus(String(value))
}

/** Engineering value of a raw one (profiles/schema.py: raw × scale + offset). */
export function toValue(info: ParameterInfo, raw: Raw): Raw {
  if (isText(info.type) || (info.scale === 1 && info.offset === 0)) return raw
  const number = Number(raw)
  return Number.isNaN(number) ? raw : Number((number * info.scale + info.offset).toPrecision(12))
}

const two = (n: number) => String(n).padStart(2, '0')

/** Time of day with seconds, 24 hours, in the time zone of this computer. */
export function clock(time: string | number | null): string {
  if (time === null) return '—'
  const at = new Date(time)
  return [at.getHours(), at.getMinutes(), at.getSeconds()].map(two).join(':')
}

/** Day and time, written as ISO 8601 does: 03/04 is not the same day everywhere. */
export function dateTime(time: string | null): string {
  if (time === null) return '—'
  const at = new Date(time)
  const day = [at.getFullYear(), two(at.getMonth() + 1), two(at.getDate())].join('-')
  return `${day} ${clock(time)}`
}
