/** Scope blocks as the server sends them (layout: backend/api/live/messages.py). */
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

/** Decode one binary frame. Throws RangeError or Error on anything that is not whole blocks. */
export function decodeBlocks(buffer: ArrayBuffer): ScopeBlock[] {
  const blocks: ScopeBlock[] = []
  for (let at = 0; at < buffer.byteLength || at === 0;) {
    const { block, end } = decodeBlock(buffer, at)
    blocks.push(block)
    at = end
  }
  return blocks
}

function decodeBlock(buffer: ArrayBuffer, at: number): { block: ScopeBlock; end: number } {
  const view = new DataView(buffer, at)
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
  if (view.byteLength < expected) {
    throw new Error(`scope block of ${view.byteLength} bytes instead of ${expected}`)
  }
  let offset = HEADER_BYTES
  const times = new Float64Array(rows)
  for (let row = 0; row < rows; row++) {
    times[row] = trueTimes ? view.getFloat64(offset + row * 8, true) : t0 + row * dt
  }
  if (trueTimes) offset += rows * 8
  // Whatever runs a browser is little endian, as the frames are; a block is whole words of 4 bytes.
  const samples = new Float64Array(
    new Float32Array(buffer, at + expected - rows * channels * 4, rows * channels),
  )
  if (withBases) {
    for (let k = 0; k < channels; k++) {
      const base = view.getFloat64(offset + k * 8, true)
      for (let i = k; i < samples.length; i += channels) samples[i] = (samples[i] as number) + base
    }
  }
  const block = {
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
  return { block, end: at + expected }
}
