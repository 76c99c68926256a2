import { describe, expect, it } from 'vitest'
import { decodeBlocks, type ScopeBlock } from './blocks'

import { csvText } from './csv-text'
import { columns, thinned } from './decimate'
import { Ring, Trace } from './ring'
import { ScopeStore } from './scope-store'
import { hasBit, Trigger, type TriggerSettings } from './trigger'
import type { ScopeConfig, ScopeTrigger, ScopeView } from '../worker/worker-messages'

/** A frame by hand, byte by byte, after the layout in backend/api/live/messages.py. */
function frame(options: {
  subscription?: number
  stream?: number
  sequence?: number
  dropped?: number
  t0?: number
  dt?: number
  times?: number[]
  bases?: number[]
  rows: number[][]
}): ArrayBuffer {
  const { rows, times, bases } = options
  const channels = rows[0]?.length ?? 0
  const extra = (times?.length ?? 0) * 8 + (bases?.length ?? 0) * 8
  const buffer = new ArrayBuffer(40 + extra + rows.length * channels * 4)
  const view = new DataView(buffer)
  view.setUint32(0, 0x424b4353, true)
  view.setUint32(4, options.subscription ?? 1, true)
  view.setUint32(8, options.sequence ?? 1, true)
  view.setUint32(12, options.dropped ?? 0, true)
  view.setUint16(16, rows.length, true)
  view.setUint16(18, channels, true)
  view.setUint32(20, (times ? 1 : 0) | (bases ? 2 : 0) | ((options.stream ?? 0) << 8), true)
  view.setFloat64(24, options.t0 ?? 0, true)
  view.setFloat64(32, options.dt ?? 0.001, true)
  let at = 40
  for (const value of [...(times ?? []), ...(bases ?? [])]) {
    view.setFloat64(at, value, true)
    at += 8
  }
  for (const value of rows.flat()) {
    view.setFloat32(at, value, true)
    at += 4
  }
  return buffer
}

function traceOf(times: number[], values: number[], capacity = 10_000): Trace {
  const ring = new Ring(capacity)
  for (const [i, time] of times.entries()) ring.push(time, values[i] as number)
  return new Trace(ring)
}

const grid = (n: number, rate: number) => Array.from({ length: n }, (_, i) => i / rate)

const decoded = (buffer: ArrayBuffer) => decodeBlocks(buffer)[0] as ScopeBlock

describe('scope blocks', () => {
  it('reads all blocks of a frame, whatever they carry', () => {
    const parts = [
      frame({ sequence: 1, times: [1, 1.7, 2], rows: [[1], [2], [3]] }),
      frame({ sequence: 2, bases: [100, 200], rows: [[1, 2]] }),
      frame({ sequence: 3, t0: 5, dt: 0.5, rows: [[7], [8]] }),
    ].map((each) => new Uint8Array(each))
    const whole = Uint8Array.from(parts.flatMap((each) => [...each]))
    const blocks = decodeBlocks(whole.buffer)
    expect(blocks.map((each) => each.sequence)).toEqual([1, 2, 3])
    expect(blocks.map((each) => [...each.samples])).toEqual([
      [1, 2, 3],
      [101, 202],
      [7, 8],
    ])
    expect([...(blocks[2] as ScopeBlock).times]).toEqual([5, 5.5])
    expect(() => decodeBlocks(whole.buffer.slice(0, whole.length - 4))).toThrow(/bytes/)
  })
  it('reads a synchronous block', () => {
    const block = decoded(
      frame({
        subscription: 3,
        stream: 2,
        sequence: 9,
        dropped: 2,
        t0: 10,
        dt: 0.5,
        rows: [
          [1, 2],
          [3, 4],
        ],
      }),
    )
    expect(block).toMatchObject({ subscription: 3, stream: 2, sequence: 9, dropped: 2, rows: 2 })
    expect(block.spacing).toBe(0.5)
    expect([...block.times]).toEqual([10, 10.5])
    expect([...block.samples]).toEqual([1, 2, 3, 4])
  })
  it('reads true times and invalid values', () => {
    const block = decoded(frame({ times: [1, 1.7], rows: [[Number.NaN], [5]] }))
    expect(block.spacing).toBeNull()
    expect([...block.times]).toEqual([1, 1.7])
    expect(block.samples[0]).toBeNaN()
  })
  it('keeps every count of a position of many turns', () => {
    // 2^30 + 1 has no float32 of its own.
    const base = 2 ** 30
    const block = decoded(frame({ bases: [base], rows: [[0], [1]] }))
    expect([...block.samples]).toEqual([base, base + 1])
  })
  it('refuses what is cut short or something else', () => {
    const whole = frame({ rows: [[1], [2]] })
    expect(() => decodeBlocks(whole.slice(0, whole.byteLength - 1))).toThrow(/bytes/)
    const other = frame({ rows: [[1]] })
    new DataView(other).setUint8(0, 0)
    expect(() => decodeBlocks(other)).toThrow(/not a scope block/)
  })
})

describe('ring', () => {
  it('keeps the newest rows', () => {
    const ring = new Ring(1024)
    for (let i = 0; i < 3000; i++) ring.push(i, -i)
    expect(ring.length).toBe(1024)
    expect(ring.time(0)).toBe(1976)
    expect(ring.value(1023)).toBe(-2999)
    expect(ring.firstAt(2000)).toBe(24)
    expect(ring.firstAfter(2000)).toBe(25)
    expect(ring.firstAt(9999)).toBe(1024)
  })
  it('begins again when the clock goes back', () => {
    const ring = new Ring(1024)
    ring.push(100, 1)
    ring.push(3, 2)
    expect(ring.length).toBe(1)
    expect(ring.newest).toBe(3)
  })
  it('finds the extremes of any stretch, also after many laps', () => {
    // A walk that is known by formula, compared with looking at every row.
    const ring = new Ring(2048)
    for (let i = 0; i < 7777; i++) ring.push(i, i % 97 === 0 ? Number.NaN : (i * 7919) % 1000)
    for (const [begin, end] of [
      [0, 2048],
      [1, 2047],
      [100, 163],
      [63, 65],
      [640, 1920],
    ] as const) {
      let low = Number.POSITIVE_INFINITY
      let high = Number.NEGATIVE_INFINITY
      for (let row = begin; row < end; row++) {
        const value = ring.value(row)
        if (Number.isNaN(value)) continue
        low = Math.min(low, value)
        high = Math.max(high, value)
      }
      expect(ring.extremes(begin, end)).toMatchObject({ low, high })
    }
    expect(ring.extremes(5, 5)).toBeNull()
  })
})

describe('decimation', () => {
  it('never loses a peak', () => {
    const times = grid(5000, 1000)
    const values = times.map(() => 0)
    values[1234] = 100
    values[4321] = -50
    const [axis, trace] = columns([traceOf(times, values)], 0, 5, 100)
    expect(axis).toHaveLength(200)
    expect(Math.max(...(trace as number[]))).toBe(100)
    expect(Math.min(...(trace as number[]))).toBe(-50)
  })
  it('shows a trace in the unit that was chosen, upside down if need be', () => {
    const { ring } = traceOf(grid(1000, 1000), grid(1000, 1000))
    const [, trace] = columns([new Trace(ring, -10, 1)], 0, 1, 10)
    expect(Math.max(...(trace as number[]))).toBe(1)
    expect(Math.min(...(trace as number[]))).toBeCloseTo(1 - 9.99, 9)
  })
  it('leaves few samples as they are, with gaps where a trace has none', () => {
    const found = columns([traceOf([0, 1], [10, 11]), traceOf([0.5, 1], [20, 21])], 0, 1, 100)
    expect(found).toEqual([
      [0, 0.5, 1],
      [10, null, 11],
      [null, 20, 21],
    ])
  })
  it('leaves a bin without samples empty', () => {
    const times = Array.from({ length: 1000 }, (_, i) => (i < 500 ? i / 1000 : 9 + i / 1000))
    const [, trace] = columns([traceOf(times, times)], 0, 10, 10)
    expect((trace as (number | null)[])[8]).toBeNull()
  })
  it('thins a curve to its extremes', () => {
    const values = new Float64Array(10_000)
    values[777] = 5
    values[7000] = -6
    const thin = thinned(grid(10_000, 1), values, 100)
    expect(thin.values.length).toBeLessThanOrEqual(100)
    expect([Math.max(...thin.values), Math.min(...thin.values)]).toEqual([5, -6])
    expect(thin.times).toEqual(thin.times.toSorted((a, b) => a - b))
  })
})

describe('trigger', () => {
  const settings: TriggerSettings = {
    kind: 'rising',
    level: 0.5,
    high: 0,
    bit: 0,
    window: 4,
    before: 0.25,
  }
  const at = (kind: TriggerSettings['kind'], values: number[], more = {}) => {
    const all = [...values, ...Array<number>(9).fill(values.at(-1) as number)]
    const trace = traceOf(
      all.map((_, i) => i),
      all,
    )
    return new Trigger({ ...settings, kind, ...more }, -1).look(trace)?.at ?? null
  }
  it('gives the stretch around an edge once it is complete', () => {
    const trigger = new Trigger(settings, -1)
    const trace = traceOf([0, 1, 2, 3], [0, 0, 1, 1])
    expect(trigger.look(trace)).toBeNull()
    for (const time of [4, 5]) trace.ring.push(time, 1)
    // Half-way between the samples at 1 and 2.
    expect(trigger.look(trace)).toEqual({ from: 0.5, to: 4.5, at: 1.5 })
    expect(trigger.look(trace)).toBeNull()
  })
  it('looks only at what came after it was armed', () => {
    const trace = traceOf([0, 1, 2, 3, 4, 5, 9], [0, 1, 1, 1, 1, 1, 1])
    expect(new Trigger(settings, 2).look(trace)).toBeNull()
  })
  it('does not take a level that was already reached for an edge', () => {
    expect(at('rising', [1, 1, 1])).toBeNull()
    expect(at('above', [1, 1, 1])).toBe(0)
    expect(at('below', [1, 0])).toBe(1)
  })
  it('fires on edges of either direction', () => {
    expect(at('falling', [1, 1, 0])).toBe(1.5)
    expect(at('either', [1, 1, 0])).toBe(1.5)
    expect(at('either', [0, 0, 2])).toBe(1.25)
  })
  it('fires on a window entered or left, at its nearer edge', () => {
    expect(at('enters', [0, 4, 1.5], { level: 1, high: 2 })).toBe(1.8)
    expect(at('enters', [1.5, 1.5], { level: 1, high: 2 })).toBeNull()
    expect(at('leaves', [1.5, 1.5, 0.5], { level: 1, high: 2 })).toBe(1.5)
  })
  it('fires on a bit and on any change', () => {
    // 0x27 is Operation enabled, 0x0F Fault reaction active, 0x08 Fault (CiA 402-2, table 29).
    expect(at('bit_set', [0x27, 0x27, 0x0f, 0x08], { bit: 3 })).toBe(2)
    expect(at('bit_clear', [0x27, 0x23], { bit: 2 })).toBe(1)
    expect(at('change', [7, 7, 7, 9])).toBe(3)
  })
  it('fires when an axis begins to move, in either direction', () => {
    expect(at('motion', [0, 2, -1, -30], { level: 10 })).toBeCloseTo(2 + 9 / 29, 9)
    expect(at('motion', [30, 30], { level: 10 })).toBeNull()
  })
  it('knows the bits of negative and of long numbers', () => {
    expect(hasBit(-1, 15)).toBe(true)
    expect(hasBit(-2, 0)).toBe(false)
    expect(hasBit(2 ** 31, 31)).toBe(true)
  })
  it('goes past an invalid sample', () => {
    expect(at('rising', [0, Number.NaN, 1])).toBe(1)
  })
})

function store() {
  const clock = { now: 0 }
  const sent: string[] = []
  const made = new ScopeStore({
    start: (message) => {
      const keys = message.channels.map((channel) => channel.key)
      sent.push(`start ${message.subscription} ${keys.join()}`)
    },
    stop: (subscription) => sent.push(`stop ${subscription}`),
    changed: () => {},
    triggered: (state) => sent.push(state),
    now: () => clock.now,
  })
  return { store: made, sent, clock }
}
const source = (id: string, key: string, drive = 'x') => ({ id, drive, key, factor: 1, offset: 0 })
const config = (...sources: ScopeConfig['sources']): ScopeConfig => ({
  sources,
  maths: [],
  period: 0,
})
const view: ScopeView = {
  ids: ['c1', 'c2'],
  show: { from: 0, to: 1000 },
  bins: 100,
  measure: null,
  cursors: [],
  persistence: false,
}

describe('scope store', () => {
  it('exports every raw sample, with the time from zero', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a'), source('c2', 'b')))
    scope.block(
      frame({
        t0: 100,
        dt: 0.5,
        rows: [
          [1, 2],
          [3, Number.NaN],
        ],
      }),
    )
    const names = ['a "x"', 'b']
    expect(scope.answer('csv', { ids: ['c1', 'c2'], names, from: 0, to: 200, origin: 100 })).toBe(
      '"time_s","a ""x""","b"\r\n0.000000,1,2\r\n0.500000,3,\r\n',
    )
  })
  it('exports no name that a spreadsheet would run', () => {
    for (const name of ['=1+1', '+1', '-1', '@x', '\t=1', ' =1'])
      expect(csvText(name)).toBe(`"'${name}"`)
    for (const name of ['a=1', 'X', '', '1-2']) expect(csvText(name)).toBe(`"${name}"`)
  })
  it('keeps what a channel has when others come and go', () => {
    const { store: scope, sent } = store()
    scope.configure(config(source('c1', 'a')))
    scope.block(frame({ t0: 0, dt: 1, rows: [[1], [2]] }))
    scope.configure(config(source('c1', 'a'), source('c2', 'b')))
    expect(sent).toEqual(['start 1 a', 'stop 1', 'start 2 a,b'])
    // A late block of the first subscription has one column; it must not be mistaken for a.
    scope.block(frame({ t0: 50, rows: [[9]], sequence: 2 }))
    scope.block(frame({ subscription: 2, t0: 60, rows: [[3, 4]] }))
    const found = scope.answer('view', view)
    expect(found.columns).toEqual([
      [0, 1, 60],
      [1, 2, 3],
      [null, null, 4],
    ])
    scope.configure(config())
    expect(sent.at(-1)).toBe('stop 2')
  })
  it('distinguishes channels of the cycle from polled ones, and counts losses of each by itself', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a'), source('c2', 'b')))
    const none = Number.NaN
    scope.block(frame({ stream: 0, sequence: 1, t0: 0, rows: [[1, none]] }))
    scope.block(frame({ stream: 1, sequence: 1, times: [0.0005], rows: [[none, 5]] }))
    scope.block(frame({ stream: 0, sequence: 2, t0: 0.001, rows: [[2, none]] }))
    scope.block(frame({ stream: 1, sequence: 2, times: [0.0015], rows: [[none, 6]] }))
    expect(scope.answer('view', view).losses).toEqual({ dropped: 0, blocks: 0, away: 0 })
    scope.block(frame({ stream: 0, sequence: 5, dropped: 40, t0: 0.002, rows: [[3, none]] }))
    const found = scope.answer('view', view)
    expect(found.losses).toEqual({ dropped: 40, blocks: 2, away: 0 })
    expect(found.columns[2]).toEqual([null, 5, null, 6, null])
  })
  it('shows invalid samples of its own stream as invalid', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    scope.block(frame({ t0: 0, rows: [[1]], sequence: 1 }))
    scope.block(frame({ t0: 0.001, rows: [[Number.NaN]], sequence: 2 }))
    const found = scope.answer('view', { ...view, ids: ['c1'] })
    expect(found.columns).toEqual([
      [0, 0.001],
      [1, null],
    ])
  })
  it('counts what passed while there was no connection', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    scope.block(frame({ t0: 0, dt: 0.001, rows: [[1], [2]], sequence: 7 }))
    scope.interrupted()
    // 0.002 to 0.600 did not come: 599 samples.
    scope.block(frame({ t0: 0.601, dt: 0.001, rows: [[3]], sequence: 1 }))
    scope.block(frame({ t0: 0.602, dt: 0.001, rows: [[3]], sequence: 2 }))
    expect(scope.answer('view', view).losses).toEqual({ dropped: 0, blocks: 0, away: 599 })
  })
  it('says how long nothing came', () => {
    const { store: scope, clock } = store()
    scope.configure(config(source('c1', 'a')))
    clock.now = 10
    scope.block(frame({ t0: 0, rows: [[1]] }))
    clock.now = 12.5
    expect(scope.answer('view', { ...view, ids: ['c1'] }).silent).toEqual([2.5])
  })

  const rising: ScopeTrigger = {
    id: 'c1',
    mode: 'normal',
    settings: { kind: 'rising', level: 0.5, high: 0, bit: 0, window: 2, before: 0.5 },
    persistence: 0,
  }
  const square = (scope: ScopeStore, periods: number, from = 0) => {
    for (let i = from; i < from + periods * 10; i++) {
      scope.block(frame({ t0: i, dt: 1, rows: [[i % 10 < 5 ? 0 : 1]], sequence: i + 1 }))
    }
  }
  const seen = (scope: ScopeStore, persistence = false) =>
    scope.answer('view', { ...view, ids: ['c1'], show: { trigger: 'newest' }, persistence })
  it('shows the newest trigger, or the first where only one is wanted', () => {
    for (const [mode, at, count] of [
      ['normal', 24.5, 3],
      ['single', 4.5, 1],
    ] as const) {
      const { store: scope } = store()
      scope.configure(config(source('c1', 'a')))
      scope.setTrigger({ ...rising, mode })
      expect(seen(scope).trigger.state).toBe('waiting')
      square(scope, 3)
      const found = seen(scope)
      expect(found.trigger).toEqual({ state: 'triggered', at, count })
      expect([found.from, found.to]).toEqual([at - 1, at + 1])
    }
  })
  it('sees a trigger where the clock goes back after it was armed', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    scope.block(frame({ times: [50], rows: [[0]], sequence: 1 }))
    scope.setTrigger({ ...rising, mode: 'single' })
    // An exchange begins, whose time lags behind that of the polled samples.
    square(scope, 1)
    expect(seen(scope).trigger).toEqual({ state: 'triggered', at: 4.5, count: 1 })
  })
  it('holds a single picture until it is armed again, with the traces that lag', () => {
    const { store: scope, clock, sent } = store()
    scope.configure(config(source('c1', 'a'), source('c2', 'b', 'y')))
    scope.setTrigger({ ...rising, mode: 'single' })
    const slow = (t0: number, sequence: number) =>
      scope.block(frame({ subscription: 2, times: [t0], rows: [[7]], sequence }))
    slow(0.2, 1)
    for (let i = 0; i < 6; i++) {
      scope.block(frame({ t0: i / 2, dt: 0.5, rows: [[i < 2 ? 0 : 1]], sequence: i + 1 }))
    }
    // Complete up to 1.75 s: the second trace may still bring its part, and nothing else comes in.
    slow(1.2, 2)
    slow(1.8, 3)
    clock.now = 100
    for (let i = 6; i < 20; i++) {
      scope.block(frame({ t0: i / 2, dt: 0.5, rows: [[0]], sequence: i + 1 }))
    }
    const whole = { ...view, show: { from: 0, to: 100 } }
    const found = scope.answer('view', whole)
    expect(found.newest).toBe(2.5)
    expect(found.columns[2]?.filter((value) => value !== null)).toEqual([7, 7, 7])
    expect(found.silent[0]).toBe(0)
    scope.setTrigger({ ...rising, mode: 'single' })
    scope.block(frame({ t0: 10, dt: 0.5, rows: [[0]], sequence: 21 }))
    expect(scope.answer('view', whole).newest).toBe(10)
    scope.setTrigger(null)
    // Commanded to every page, once for each change.
    expect(sent.slice(2)).toEqual(['waiting', 'triggered', 'waiting', 'off'])
  })
  it('keeps a picture that stands, and runs on when it is followed again', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    const rows = new Array<number[]>(32_000).fill([1])
    const send = (i: number) => scope.block(frame({ t0: i * 32, dt: 0.001, rows, sequence: i + 1 }))
    const shown = (show: ScopeView['show']) =>
      scope.answer('view', { ...view, ids: ['c1'], show, measure: 'shown' }).measurements?.[0]
    send(0)
    expect(shown({ from: 10, to: 20 })?.count).toBe(10_001)
    // 320 s are kept; these are 384.
    for (let i = 1; i < 12; i++) send(i)
    expect(shown({ from: 10, to: 20 })?.count).toBe(10_001)
    shown({ window: 1 })
    for (let i = 12; i < 23; i++) send(i)
    expect(shown({ from: 10, to: 20 })).toBeNull()
  })
  it('shows what would lie before the trigger while it waits for one', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    scope.setTrigger(rising)
    scope.block(frame({ t0: 5, dt: 1, rows: [[0], [0]] }))
    const found = seen(scope)
    expect([found.from, found.to]).toEqual([5, 7])
    expect(found.columns[0]).toEqual([5, 6])
  })
  it('runs free in automatic mode when no trigger comes, and says so', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    scope.setTrigger({ ...rising, mode: 'auto' })
    for (let i = 0; i < 8; i++) {
      scope.block(frame({ t0: i, dt: 1, rows: [[i < 5 ? 0 : 1]], sequence: i + 1 }))
    }
    expect(seen(scope).trigger.state).toBe('triggered')
    for (let i = 8; i < 30; i++) {
      scope.block(frame({ t0: i, dt: 1, rows: [[0]], sequence: i + 1 }))
    }
    const found = seen(scope)
    expect(found.trigger.state).toBe('auto')
    expect([found.from, found.to]).toEqual([27, 29])
  })
  it('keeps earlier sweeps in sight, counted from their triggers', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a')))
    scope.setTrigger({ ...rising, persistence: 2 })
    square(scope, 5)
    const found = seen(scope, true)
    expect(found.overlays).toHaveLength(2)
    expect(found.overlays[0]).toEqual({ trace: 0, times: [-0.5, 0.5], values: [0, 1] })
  })
  it('computes channels as samples come, and again in another unit', () => {
    const { store: scope } = store()
    const sources = [source('c1', 'a')]
    const maths = [
      { id: 'm1', expression: 'derivative(c1)' },
      { id: 'm2', expression: 'm1 * 2' },
      { id: 'm3', expression: 'm4' },
      { id: 'm4', expression: '(' },
    ]
    scope.configure({ sources, maths, period: 0 })
    for (let i = 0; i < 4; i++) {
      scope.block(frame({ t0: i, dt: 1, rows: [[i * i]], sequence: i + 1 }))
    }
    const shown = () =>
      scope.answer('view', { ...view, ids: ['m1', 'm2', 'm3', 'm4'] }).columns.slice(1)
    const nothing = [null, null, null, null]
    expect(shown()).toEqual([[null, 1, 3, 5], [null, 2, 6, 10], nothing, nothing])
    scope.configure({ sources: [{ ...source('c1', 'a'), factor: 10 }], maths, period: 0 })
    expect(shown()[0]).toEqual([null, 10, 30, 50])
  })
  it('draws one channel over another', () => {
    const { store: scope } = store()
    scope.configure(config(source('c1', 'a'), source('c2', 'b')))
    const rows = grid(100, 100).map((t) => [Math.cos(2 * Math.PI * t), Math.sin(2 * Math.PI * t)])
    scope.block(frame({ t0: 0, dt: 0.01, rows }))
    const { x, y, times } = scope.answer('xy', { x: 'c1', y: 'c2', from: 0, to: 1, most: 1000 })
    expect(x).toHaveLength(100)
    expect(times[25]).toBeCloseTo(0.25)
    expect(y[25]).toBeCloseTo(1)
    for (const [i, each] of x.entries()) expect(Math.hypot(each, y[i] ?? 0)).toBeCloseTo(1, 6)
  })
})
