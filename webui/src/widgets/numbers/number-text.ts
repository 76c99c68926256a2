/** What a typed number must be. */
interface Bounds {
  min?: number | undefined
  max?: number | undefined
  /** Exclusive lower limit. */
  above?: number | undefined
  /** Exclusive upper limit. */
  below?: number | undefined
  integer?: boolean | undefined
}

type Fault =
  | { key: 'number.bad' | 'number.whole' }
  | { key: 'number.above' | 'number.below' | 'number.low' | 'number.high'; limit: number }

/** The number of a typed text, with point or comma; null where it is none that can be sent. */
export function toNumber(text: string): number | null {
  const plain = text.trim().replace('−', '-').replace(',', '.')
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) return null
  const number = Number(plain)
  // 1e400 is infinite, and infinite is sent as if nothing had been typed.
  return Number.isFinite(number) ? number : null
}

/** Why a text that is not empty is not allowed; null where it is. */
export function faultOf(text: string, { min, max, above, below, integer }: Bounds): Fault | null {
  const number = toNumber(text)
  if (number === null) return { key: 'number.bad' }
  if (integer && !Number.isInteger(number)) return { key: 'number.whole' }
  if (above !== undefined && number <= above) return { key: 'number.above', limit: above }
  if (below !== undefined && number >= below) return { key: 'number.below', limit: below }
  if (min !== undefined && number < min) return { key: 'number.low', limit: min }
  if (max !== undefined && number > max) return { key: 'number.high', limit: max }
  return null
}
