/** Scope blocks as the server sends them (layout: backend/api/live_messages.py). */
export interface ScopeBlock {
  subscription: number
  /** Sequence and dropped samples are of one stream of the subscription. */
  stream: number
  sequence: number
  dropped: number
  rows: number
  channels: number
  /** Spacing of a synchronous block; null where each row has a time of its own. */
  spacing: number | null
  /** Seconds, one per row. */
  times: Float64Array
  /** Row after row, engineering units, NaN where a value is not valid. */
  samples: Float64Array
}

const MAGIC = 0x424b4353
/** 4 × u32, 2 × u16, u32, 2 × f64. */
const HEADER_BYTES = 40
const TRUE_TIMES = 1
const BASES = 2

/** Decode one binary frame. Throws RangeError or Error on anything that is not a whole block. */
export function decodeBlock(buffer: ArrayBuffer): ScopeBlock {
  const view = new DataView(buffer)
  if (view.getUint32(0, true) !== MAGIC) throw new Error('not a scope block')
  const rows = view.getUint16(16, true)
  const channels = view.getUint16(18, true)
  const flags = view.getUint32(20, true)
  const t0 = view.getFloat64(24, true)
  const dt = view.getFloat64(32, true)
  const trueTimes = (flags & TRUE_TIMES) !== 0
  const withBases = (flags & BASES) !== 0
  const expected =
    HEADER_BYTES + (trueTimes ? rows * 8 : 0) + (withBases ? channels * 8 : 0) + rows * channels * 4
  if (buffer.byteLength !== expected) {
    throw new Error(`scope block of ${buffer.byteLength} bytes instead of ${expected}`)
  }
  let offset = HEADER_BYTES
  const times = new Float64Array(rows)
  for (let row = 0; row < rows; row++) {
    times[row] = trueTimes ? view.getFloat64(offset + row * 8, true) : t0 + row * dt
  }
  if (trueTimes) offset += rows * 8
  const bases = new Float64Array(channels)
  if (withBases) {
    for (let k = 0; k < channels; k++) bases[k] = view.getFloat64(offset + k * 8, true)
    offset += channels * 8
  }
  const samples = new Float64Array(rows * channels)
  for (let row = 0, i = 0; row < rows; row++) {
    for (let k = 0; k < channels; k++, i++) {
      samples[i] = view.getFloat32(offset + i * 4, true) + (bases[k] as number)
    }
  }
  return {
    subscription: view.getUint32(4, true),
    stream: (flags >> 8) & 0xff,
    sequence: view.getUint32(8, true),
    dropped: view.getUint32(12, true),
    rows,
    channels,
    spacing: trueTimes ? null : dt,
    times,
    samples,
  }
}
