import { describe, expect, it } from 'vitest'
import { channelsOf, compile, ExpressionError, parse } from './expression'
import { MathsChannel } from './maths'
import { Ring, Trace } from '../ring'
import { EVEN, fft, spectrogram, spectrum, WINDOWS } from './spectrum'

const value = (text: string, channels: Record<string, number> = {}) =>
  compile(parse(text))(0, (name) => channels[name] ?? Number.NaN)

describe('expressions', () => {
  it('follow the rules of arithmetic', () => {
    expect(value('1 + 2 * 3')).toBe(7)
    expect(value('(1 + 2) * 3')).toBe(9)
    expect(value('2 - 3 - 4')).toBe(-5)
    expect(value('24 / 4 / 2')).toBe(3)
    expect(value('-2 ^ 2')).toBe(-4)
    expect(value('2 ^ 3 ^ 2')).toBe(512)
    expect(value('2 * -3')).toBe(-6)
    expect(value('1.5e3 + .5')).toBe(1500.5)
    expect(value('cos(pi)')).toBeCloseTo(-1, 12)
  })
  it('take channels and functions', () => {
    expect(value('abs(c1 - c2) × 2', { c1: 1, c2: 4 })).toBe(6)
    expect(value('max(c1, 0)', { c1: -3 })).toBe(0)
    expect(value('bit(c1, 3) + bit(c1, 0)', { c1: 0x09 })).toBe(2)
    expect(channelsOf(parse('c2 + m1 * c2 - abs(c1)'))).toEqual(['c2', 'm1', 'c1'])
  })
  it.each([
    ['', 'empty'],
    ['1 +', 'end'],
    ['(c1', 'end'],
    ['c1)', 'unexpected'],
    ['c1 c2', 'unexpected'],
    ['velocity', 'unknown'],
    ['constructor(1)', 'unknown'],
    ['min(c1)', 'arguments'],
    ['abs(c1, c2)', 'arguments'],
    ['lowpass(c1, c2)', 'constant'],
    ['c1; alert(1)', 'unexpected'],
    [`${'('.repeat(60)}c1`, 'deep'],
  ])('refuse %j', (text, problem) => {
    let found: unknown
    try {
      parse(text)
    } catch (error) {
      found = error
    }
    expect(found).toBeInstanceOf(ExpressionError)
    expect((found as ExpressionError).problem).toBe(problem)
  })
})

/** A signal sampled at a rate. */
function signal(rate: number, seconds: number, of: (t: number) => number): Trace {
  const ring = new Ring(100_000)
  for (let i = 0; i < rate * seconds; i++) ring.push(i / rate, of(i / rate))
  return new Trace(ring)
}
function computed(text: string, channels: Record<string, Trace>): Trace {
  const channel = new MathsChannel(text, 100_000, (name) => channels[name] ?? null)
  channel.advance()
  return channel.trace
}
const last = (trace: Trace) => trace.value(trace.ring.length - 1)

describe('computed channels', () => {
  it('derive: the slope of sin is cos', () => {
    const w = 2 * Math.PI
    const found = computed('derivative(c1)', { c1: signal(1000, 1, (t) => Math.sin(w * t)) })
    expect(found.value(0)).toBeNaN()
    // The slope over a sample belongs to its middle.
    for (const row of [100, 500, 900]) {
      expect(found.value(row)).toBeCloseTo(w * Math.cos((w * (row - 0.5)) / 1000), 3)
    }
  })
  it('integrate: a ramp gives half its square', () => {
    const found = computed('integral(c1)', { c1: signal(1000, 2, (t) => 3 * t) })
    const end = 1.999
    expect(last(found)).toBeCloseTo(1.5 * end * end, 9)
  })
  it('filter: a step reaches 1 − e⁻¹ after one time constant', () => {
    const hz = 1 / (2 * Math.PI * 0.1) // T = 0.1 s
    const c1 = signal(1000, 1, (t) => (t === 0 ? 0 : 1))
    const low = computed(`lowpass(c1, ${hz})`, { c1 })
    expect(low.at(0.1)).toBeCloseTo(1 - Math.exp(-1), 9)
    const high = computed(`highpass(c1, ${hz})`, { c1 })
    expect(high.at(0.1)).toBeCloseTo(Math.exp(-1), 9)
  })
  it('average: over whole periods a sine vanishes', () => {
    const c1 = signal(1000, 8, (t) => 5 + Math.sin(2 * Math.PI * 10 * t))
    expect(last(computed('mean(c1, 0.1)', { c1 }))).toBeCloseTo(5, 9)
  })
  it('take another rate on the line between its samples, and wait for it', () => {
    const c1 = signal(100, 1, () => 0)
    const c2 = signal(7, 0.5, (t) => 4 * t)
    const found = computed('c1 + c2', { c1, c2 })
    expect(found.at(0.33)).toBeCloseTo(1.32, 12)
    expect(found.ring.newest).toBeLessThanOrEqual(c2.ring.newest as number)
  })
  it('go past an invalid sample', () => {
    const c1 = signal(10, 1, (t) => (t === 0.5 ? Number.NaN : 2))
    const found = computed('integral(c1)', { c1 })
    expect(found.value(5)).toBeNaN()
    expect(last(found)).toBeCloseTo(1.8, 9)
  })
})

const columnsOf = (trace: Trace) => {
  const rows = trace.ring.length
  return {
    times: Float64Array.from({ length: rows }, (_, row) => trace.ring.time(row)),
    values: Float64Array.from({ length: rows }, (_, row) => trace.value(row)),
  }
}

describe('spectrum', () => {
  it('of a pulse is flat, and its inverse bin order is right', () => {
    const re = new Float64Array(8)
    const im = new Float64Array(8)
    re[1] = 1
    fft(re, im)
    for (let k = 0; k < 8; k++) {
      expect(re[k]).toBeCloseTo(Math.cos((2 * Math.PI * k) / 8), 12)
      expect(im[k]).toBeCloseTo(-Math.sin((2 * Math.PI * k) / 8), 12)
    }
  })
  it.each(WINDOWS)('shows two sines with their amplitudes, window %s', (window) => {
    // 50 Hz and 120 Hz fall on lines of one second: no window may change their amplitudes.
    const trace = signal(
      1024,
      1,
      (t) => 7 + 3 * Math.sin(2 * Math.PI * 50 * t + 1) + 0.5 * Math.sin(2 * Math.PI * 120 * t),
    )
    const { times, values } = columnsOf(trace)
    const found = spectrum(times, values, window)
    // Padded to twice the length, so that lines lie half a hertz apart.
    expect(found?.amplitude[100]).toBeCloseTo(3, 6)
    expect(found?.amplitude[240]).toBeCloseTo(0.5, 6)
    const near = found?.peaks.find((peak) => Math.abs(peak.frequency - 50) < 0.5)
    expect(Math.abs((near?.amplitude ?? 0) - 3)).toBeLessThan(0.06)
    expect(found?.amplitude[0]).toBeCloseTo(7, 6)
    expect(found?.sampleRate).toBeCloseTo(1024, 6)
    expect(found?.resolution).toBeCloseTo(1, 6)
    expect(found?.resampled).toBe(false)
  })
  it('places a sine between the lines', () => {
    const trace = signal(4000, 0.5, (t) => 2 * Math.sin(2 * Math.PI * 333.3 * t))
    const { times, values } = columnsOf(trace)
    const peak = spectrum(times, values, 'hann')?.peaks[0]
    expect(Math.abs((peak?.frequency ?? 0) - 333.3)).toBeLessThan(0.05)
    expect(Math.abs((peak?.amplitude ?? 0) - 2)).toBeLessThan(0.02)
  })
  it('puts unequal samples onto a grid, and says so', () => {
    const times = Float64Array.from({ length: 2000 }, (_, i) => i / 1000 + (i % 3) * 2e-4)
    const values = times.map((t) => Math.sin(2 * Math.PI * 20 * t))
    const found = spectrum(times, values, 'hann')
    expect(found?.resampled).toBe(true)
    expect(found?.peaks[0]?.frequency).toBeCloseTo(20, 1)
    expect(found?.peaks[0]?.amplitude).toBeCloseTo(1, 1)
    // Cycles of a bus whose time stamps waver are equally spaced all the same.
    expect(spectrum(times, values, 'hann', EVEN.synchronous)?.resampled).toBe(false)
  })
  it('needs some samples', () => {
    expect(spectrum(new Float64Array(3), new Float64Array(3), 'hann')).toBeNull()
  })
  it('follows a frequency that changes', () => {
    const trace = signal(1000, 4, (t) => Math.sin(2 * Math.PI * (t < 2 ? 50 : 200) * t))
    const { times, values } = columnsOf(trace)
    const found = spectrogram(times, values, 100)
    const rows = found?.frequency.length ?? 0
    const loudest = (column: number) => {
      const part = [...(found?.amplitude ?? [])].slice(column * rows, (column + 1) * rows)
      return found?.frequency[part.indexOf(Math.max(...part))] ?? 0
    }
    const count = found?.times.length ?? 0
    expect(Math.abs(loudest(5) - 50)).toBeLessThan(10)
    expect(Math.abs(loudest(count - 5) - 200)).toBeLessThan(10)
  })
})

describe('a computed channel whose clock begins again, as after a restart of the server', () => {
  it('goes on with the new times', () => {
    const ring = new Ring(1024)
    const channel = new MathsChannel('integral(c1)', 1024, () => new Trace(ring))
    for (let i = 0; i < 5; i++) ring.push(1000 + i, 1)
    channel.advance()
    expect(channel.trace.ring.newest).toBe(1004)
    for (let i = 0; i < 3; i++) ring.push(10 + i, 1)
    channel.advance()
    expect(channel.trace.ring.length).toBe(3)
    expect(channel.trace.ring.newest).toBe(12)
    // Counted from the first new sample.
    expect(channel.trace.value(2)).toBe(2)
  })
})
