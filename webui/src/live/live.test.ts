import { describe, expect, it, vi } from 'vitest'
import type { JogStart } from '../api/schema'
import { decodeBlock } from './blocks'
import { DeadMan, SILENCE_MS } from './deadman'
import { columns } from './decimate'
import { measure, valueAt } from './measure'
import { Ring } from './ring'
import { ScopeStore } from './scope-store'
import { backOff, LiveSocket, type SocketLike } from './socket'
import { Trigger } from './trigger'

/** A frame by hand, byte by byte, after the layout in backend/api/live_messages.py. */
function frame(options: {
  subscription?: number
  sequence?: number
  dropped?: number
  t0?: number
  dt?: number
  times?: number[]
  rows: number[][]
}): ArrayBuffer {
  const { rows, times } = options
  const channels = rows[0]?.length ?? 0
  const buffer = new ArrayBuffer(40 + (times ? times.length * 8 : 0) + rows.length * channels * 4)
  const view = new DataView(buffer)
  view.setUint32(0, 0x424b4353, true)
  view.setUint32(4, options.subscription ?? 7, true)
  view.setUint32(8, options.sequence ?? 1, true)
  view.setUint32(12, options.dropped ?? 0, true)
  view.setUint16(16, rows.length, true)
  view.setUint16(18, channels, true)
  view.setUint32(20, times ? 1 : 0, true)
  view.setFloat64(24, options.t0 ?? 0, true)
  view.setFloat64(32, options.dt ?? 0.001, true)
  let at = 40
  for (const time of times ?? []) {
    view.setFloat64(at, time, true)
    at += 8
  }
  for (const value of rows.flat()) {
    view.setFloat32(at, value, true)
    at += 4
  }
  return buffer
}

function ringOf(times: number[], values: number[]): Ring {
  const ring = new Ring(1, 10_000)
  ring.push(decodeBlock(frame({ times, rows: values.map((value) => [value]) })))
  return ring
}

describe('scope blocks', () => {
  it('reads a synchronous block', () => {
    const block = decodeBlock(
      frame({
        subscription: 3,
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
    expect(block).toMatchObject({ subscription: 3, sequence: 9, dropped: 2, rows: 2, channels: 2 })
    expect([...block.times]).toEqual([10, 10.5])
    expect([...block.samples]).toEqual([1, 2, 3, 4])
  })
  it('reads true times and invalid values', () => {
    const block = decodeBlock(frame({ times: [1, 1.7], rows: [[Number.NaN], [5]] }))
    expect([...block.times]).toEqual([1, 1.7])
    expect(block.samples[0]).toBeNaN()
  })
  it('refuses what is cut short or something else', () => {
    const whole = frame({ rows: [[1], [2]] })
    expect(() => decodeBlock(whole.slice(0, whole.byteLength - 1))).toThrow(/bytes/)
    const other = frame({ rows: [[1]] })
    new DataView(other).setUint8(0, 0)
    expect(() => decodeBlock(other)).toThrow(/not a scope block/)
  })
})

describe('ring', () => {
  it('keeps the newest rows and counts what the server left out', () => {
    const ring = new Ring(1, 3)
    ring.push(decodeBlock(frame({ t0: 0, dt: 1, rows: [[0], [1]], sequence: 1 })))
    ring.push(decodeBlock(frame({ t0: 2, dt: 1, rows: [[2], [3]], sequence: 4, dropped: 5 })))
    expect(ring.length).toBe(3)
    expect([0, 1, 2].map((row) => ring.value(row, 0))).toEqual([1, 2, 3])
    expect(ring.dropped).toBe(5)
    expect(ring.lostBlocks).toBe(2)
    expect(ring.firstAt(2)).toBe(1)
    expect(ring.firstAt(9)).toBe(3)
  })
})

describe('decimation', () => {
  it('never loses a peak', () => {
    const times = Array.from({ length: 5000 }, (_, i) => i / 1000)
    const values = times.map(() => 0)
    values[1234] = 100
    values[4321] = -50
    const [axis, trace] = columns([{ ring: ringOf(times, values), channel: 0 }], 0, 5, 100)
    expect(axis).toHaveLength(200)
    expect(Math.max(...(trace as number[]))).toBe(100)
    expect(Math.min(...(trace as number[]))).toBe(-50)
  })
  it('leaves few samples as they are, with gaps where a trace has none', () => {
    const first = ringOf([0, 1], [10, 11])
    const second = ringOf([0.5, 1], [20, 21])
    const found = columns(
      [
        { ring: first, channel: 0 },
        { ring: second, channel: 0 },
      ],
      0,
      1,
      100,
    )
    expect(found).toEqual([
      [0, 0.5, 1],
      [10, null, 11],
      [null, 20, 21],
    ])
  })
  it('leaves a bin without samples empty', () => {
    const times = Array.from({ length: 1000 }, (_, i) => (i < 500 ? i / 1000 : 9 + i / 1000))
    const [, trace] = columns([{ ring: ringOf(times, times), channel: 0 }], 0, 10, 10)
    expect((trace as (number | null)[])[8]).toBeNull()
  })
})

describe('measurements', () => {
  it('agree with a sine: mean 0, RMS A/√2, peak-peak 2A', () => {
    const n = 1000
    const times = Array.from({ length: n }, (_, i) => i / n)
    const values = times.map((time) => 3 * Math.sin(2 * Math.PI * 5 * time))
    const found = measure({ ring: ringOf(times, values), channel: 0 }, 0, 1)
    expect(found?.count).toBe(n)
    expect(found?.mean).toBeCloseTo(0, 5)
    expect(found?.rms).toBeCloseTo(3 / Math.SQRT2, 5)
    expect(found?.peakToPeak).toBeCloseTo(6, 3)
  })
  it('leave invalid samples out', () => {
    const ring = ringOf([0, 1, 2], [1, Number.NaN, 3])
    expect(measure({ ring, channel: 0 }, 0, 2)).toMatchObject({ count: 2, mean: 2 })
    expect(valueAt({ ring, channel: 0 }, 1.5)).toBe(1)
    expect(valueAt({ ring, channel: 0 }, -1)).toBeNull()
  })
})

describe('trigger', () => {
  const settings = { kind: 'rising', level: 0.5, window: 4, before: 0.25 } as const
  it('gives the stretch around a rising edge once it is complete', () => {
    const trigger = new Trigger(settings, 0)
    const ring = ringOf([0, 1, 2, 3], [0, 0, 1, 1])
    expect(trigger.look({ ring, channel: 0 })).toBeNull()
    ring.push(decodeBlock(frame({ times: [4, 5, 6], rows: [[1], [1], [1]] })))
    expect(trigger.look({ ring, channel: 0 })).toEqual([1, 5])
  })
  it('does not take a level that was already reached for an edge', () => {
    const ring = ringOf([0, 1, 2, 9], [1, 1, 1, 1])
    expect(new Trigger(settings, 0).look({ ring, channel: 0 })).toBeNull()
  })
  it('fires on a level, and on a falling edge', () => {
    const ring = ringOf([0, 1, 2, 3, 9], [1, 1, 0, 0, 0])
    expect(new Trigger({ ...settings, kind: 'above' }, 0).look({ ring, channel: 0 })).toEqual([
      -1, 3,
    ])
    expect(new Trigger({ ...settings, kind: 'falling' }, 0).look({ ring, channel: 0 })).toEqual([
      1, 5,
    ])
  })
})

describe('scope store', () => {
  it('exports every raw sample, with the time from zero', () => {
    const store = new ScopeStore()
    store.add(7, 2)
    store.block(
      frame({
        t0: 100,
        dt: 0.5,
        rows: [
          [1, 2],
          [3, Number.NaN],
        ],
      }),
    )
    const traces = [0, 1].map((channel) => ({ subscription: 7, channel }))
    expect(store.csv(traces, ['a "x"', 'b'], 0, 200)).toBe(
      '"time_s","a ""x""","b"\r\n0.000000,1,2\r\n0.500000,3,\r\n',
    )
  })
})

const start: JogStart = {
  type: 'jog_start',
  drive: 'x',
  direction: 1,
  speed: 1,
  acceleration: 1,
  travel_limit: 1,
  torque_limit: 10,
}

describe('dead man', () => {
  function make(connected = true) {
    const clock = { now: 0 }
    const sent: { type: string; reason?: string }[] = []
    const deadMan = new DeadMan(
      (message) => {
        if (connected) sent.push(message)
        return connected
      },
      () => clock.now,
    )
    return { clock, sent, deadMan }
  }
  it('renews while the page beats', () => {
    const { clock, sent, deadMan } = make()
    deadMan.start(start)
    for (clock.now = 16; clock.now < 400; clock.now += 16) {
      deadMan.beat('x')
      if (clock.now % 48 === 0) deadMan.tick()
    }
    expect(sent.filter((message) => message.type === 'jog_renew').length).toBeGreaterThan(5)
    expect(sent.some((message) => message.type === 'jog_stop')).toBe(false)
  })
  it('stops by itself when the page falls silent, though its own timer runs on', () => {
    const { clock, sent, deadMan } = make()
    deadMan.start(start)
    clock.now = SILENCE_MS + 1
    deadMan.tick()
    expect(sent.at(-1)).toMatchObject({ type: 'jog_stop', reason: 'the page fell silent' })
    deadMan.beat('x')
    deadMan.tick()
    expect(sent).toHaveLength(2)
  })
  it('is not revived by a late beat', () => {
    const { clock, sent, deadMan } = make()
    deadMan.start(start)
    clock.now = SILENCE_MS + 1
    deadMan.beat('x')
    expect(sent.at(-1)?.type).toBe('jog_stop')
    expect(deadMan.held).toBeNull()
  })
  it('does not hold without a connection', () => {
    const { deadMan } = make(false)
    expect(deadMan.start(start)).toBe(false)
    expect(deadMan.held).toBeNull()
  })
})

class FakeSocket implements SocketLike {
  binaryType = ''
  readyState = 0
  onopen: (() => void) | null = null
  onclose: (() => void) | null = null
  onmessage: ((event: { data: unknown }) => void) | null = null
  sent: string[] = []
  send(data: string) {
    this.sent.push(data)
  }
  close() {
    this.readyState = 3
  }
  open() {
    this.readyState = 1
    this.onopen?.()
  }
}

describe('live socket', () => {
  function make() {
    const sockets: FakeSocket[] = []
    const clock = { now: 0 }
    const events = { state: vi.fn(), message: vi.fn(), block: vi.fn(), closed: vi.fn() }
    const live = new LiveSocket(
      () => {
        const socket = new FakeSocket()
        sockets.push(socket)
        return socket
      },
      events,
      () => clock.now,
    )
    return { sockets, clock, events, live }
  }
  it('waits longer from try to try, but never long', () => {
    const delays = [1, 2, 3, 4, 5, 6, 7].map((attempt) => backOff(attempt, () => 0))
    expect(delays).toEqual([250, 500, 1000, 2000, 4000, 4000, 4000])
    expect(backOff(1, () => 1)).toBe(187.5)
  })
  it('repeats standing requests after a reconnection, and nothing else', () => {
    vi.useFakeTimers()
    const { sockets, live, events } = make()
    live.connect()
    sockets[0]?.open()
    live.stand('state', { type: 'watch_state', drives: ['x'] })
    live.send(start)
    sockets[0]?.onclose?.()
    expect(events.closed).toHaveBeenCalledOnce()
    expect(live.send(start)).toBe(false)
    vi.advanceTimersByTime(300)
    sockets[1]?.open()
    expect(sockets[1]?.sent.map((text) => (JSON.parse(text) as { type: string }).type)).toEqual([
      'watch_state',
    ])
    vi.useRealTimers()
  })
  it('gives up a connection that has gone silent', () => {
    vi.useFakeTimers()
    const { sockets, clock, live, events } = make()
    live.connect()
    sockets[0]?.open()
    clock.now = 4000
    live.beat()
    expect(events.closed).toHaveBeenCalledOnce()
    expect(sockets[0]?.readyState).toBe(3)
    vi.useRealTimers()
  })
  it('measures the round trip', () => {
    const { sockets, clock, live, events } = make()
    live.connect()
    sockets[0]?.open()
    live.beat()
    clock.now = 12
    sockets[0]?.onmessage?.({ data: JSON.stringify({ type: 'pong', n: 1 }) })
    expect(events.state).toHaveBeenLastCalledWith({ open: true, attempt: 0, roundTripMs: 12 })
  })
})
