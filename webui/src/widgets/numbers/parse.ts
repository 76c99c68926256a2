import { isInteger, isText, toValue } from './format'
import type { ParameterInfo, Raw } from '../parameters/types'

/** A typed text: what would be sent, or why it cannot be. */
export type Typed =
  | { ok: true; raw?: Raw; value?: number }
  | { ok: false; why: 'number' | 'low' | 'high' | 'whole' | 'long'; limit?: string }

/**
 * What a typed text means. Hexadecimal and enum values are raw; a plain number is in the
 * parameter's unit. The server checks again; this only saves the round trip.
 */
export function parseTyped(info: ParameterInfo, text: string, asRaw: boolean): Typed {
  const trimmed = text.trim().replace('−', '-').replace(',', '.')
  if (isText(info.type)) return { ok: true, raw: text }
  const hex = /^0x[0-9a-f]+$/i.test(trimmed)
  if (trimmed === '' || (!hex && !/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(trimmed))) {
    return { ok: false, why: 'number' }
  }
  const exact = wholeText(info, trimmed, asRaw)
  if (exact !== null) return exact
  const number = Number(trimmed)
  if (!Number.isFinite(number)) return { ok: false, why: 'long' }
  const raw = hex || asRaw || Object.keys(info.enum).length > 0
  const scaled = raw ? number : (number - info.offset) / info.scale
  const whole = isInteger(info.type)
  if (whole && raw && !Number.isInteger(number)) return { ok: false, why: 'whole' }
  const checked = whole ? Math.round(scaled) : scaled
  if (!Number.isSafeInteger(checked) && whole) return { ok: false, why: 'long' }
  const { min_raw: low, max_raw: high } = info
  if (low !== null && checked < low) return { ok: false, why: 'low', limit: inUnit(info, low) }
  if (high !== null && checked > high) return { ok: false, why: 'high', limit: inUnit(info, high) }
  if (whole && !raw && Math.abs(scaled - checked) > 1e-6 * Math.max(1, Math.abs(scaled))) {
    // Between two steps: the nearest one is written, and shown as such when it is read back.
    return { ok: true, raw: checked }
  }
  return raw || whole ? { ok: true, raw: checked } : { ok: true, value: number }
}

/**
 * A whole number that a number of this language does not hold exactly, as its digits; null for all
 * others. In a unit with a scale it stays what it was: the drive rounds it anyway.
 */
function wholeText(info: ParameterInfo, text: string, asRaw: boolean): Typed | null {
  const whole = /^[+-]?\d+$/.test(text) || /^0x[0-9a-f]+$/i.test(text)
  const plain = asRaw || /^0x/i.test(text) || (info.scale === 1 && info.offset === 0)
  if (!whole || !plain || (info.type !== 'INT64' && info.type !== 'UINT64')) return null
  const exact = BigInt(text.replace('+', ''))
  if (Number.isSafeInteger(Number(exact))) return null
  const fits = info.type === 'INT64' ? BigInt.asIntN(64, exact) : BigInt.asUintN(64, exact)
  if (fits !== exact) return { ok: false, why: 'long' }
  const { min_raw: low, max_raw: high } = info
  if (low !== null && exact < low) return { ok: false, why: 'low', limit: inUnit(info, low) }
  if (high !== null && exact > high) return { ok: false, why: 'high', limit: inUnit(info, high) }
  return { ok: true, raw: String(exact) }
}

function inUnit(info: ParameterInfo, raw: number): string {
  return `${toValue(info, raw)}${info.unit ? ` ${info.unit}` : ''}`
}

/** One field of a bit parameter: `'3'` or `'6-4'`, high to low. */
export interface BitField {
  low: number
  width: number
  label: string
}

export function bitFields(info: ParameterInfo): BitField[] {
  return Object.entries(info.bits)
    .flatMap(([range, label]) => {
      const match = /^(\d+)(?:-(\d+))?$/.exec(range)
      if (!match) return []
      const a = Number(match[1])
      const b = Number(match[2] ?? match[1])
      return [{ low: Math.min(a, b), width: Math.abs(a - b) + 1, label }]
    })
    .sort((a, b) => a.low - b.low)
}

/** Value of a field in a raw integer; beyond 32 bits JavaScript's own operators are wrong. */
export function getField(raw: number, field: BitField): number {
  return Number((BigInt(raw) >> BigInt(field.low)) & ((1n << BigInt(field.width)) - 1n))
}

/** The raw integer with one field replaced; signed types keep their sign bit's meaning. */
export function setField(raw: number, field: BitField, value: number, type: string): number {
  const mask = ((1n << BigInt(field.width)) - 1n) << BigInt(field.low)
  const bits = type.startsWith('INT') ? Number(type.slice(3)) : 64
  const next = (BigInt(raw) & ~mask) | (BigInt(value) << BigInt(field.low))
  return Number(type.startsWith('INT') ? BigInt.asIntN(bits, next) : BigInt.asUintN(bits, next))
}
