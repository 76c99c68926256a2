/** Scope blocks as the server sends them (layout: backend/api/live_messages.py). */
export interface ScopeBlock {
  subscription: number
  sequence: number
  dropped: number
  rows: number
  channels: number
  /** Seconds, one per row. */
  times: Float64Array
  /** Row after row, engineering units, NaN where a value is not valid. */
  samples: Float32Array
}

const MAGIC = 0x424b4353
/** 4 × u32, 2 × u16, u32, 2 × f64. */
const HEADER_BYTES = 40

/** Decode one binary frame. Throws RangeError or Error on anything that is not a whole block. */
export function decodeBlock(buffer: ArrayBuffer): ScopeBlock {
  const view = new DataView(buffer)
  if (view.getUint32(0, true) !== MAGIC) throw new Error('not a scope block')
  const rows = view.getUint16(16, true)
  const channels = view.getUint16(18, true)
  const trueTimes = (view.getUint32(20, true) & 1) !== 0
  const t0 = view.getFloat64(24, true)
  const dt = view.getFloat64(32, true)
  let offset = HEADER_BYTES
  const expected = offset + (trueTimes ? rows * 8 : 0) + rows * channels * 4
  if (buffer.byteLength !== expected) {
    throw new Error(`scope block of ${buffer.byteLength} bytes instead of ${expected}`)
  }
  const times = new Float64Array(rows)
  for (let row = 0; row < rows; row++) {
    times[row] = trueTimes ? view.getFloat64(offset + row * 8, true) : t0 + row * dt
  }
  if (trueTimes) offset += rows * 8
  const samples = new Float32Array(rows * channels)
  for (let i = 0; i < samples.length; i++) samples[i] = view.getFloat32(offset + i * 4, true)
  return {
    subscription: view.getUint32(4, true),
    sequence: view.getUint32(8, true),
    dropped: view.getUint32(12, true),
    rows,
    channels,
    times,
    samples,
  }
}
