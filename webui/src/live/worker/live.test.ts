import { describe, expect, it, vi } from 'vitest'
import type { JogStart } from '../../api/schema'
import { DeadMan, RELEASED_MS, SILENCE_MS } from './deadman'
import { backOff, LiveSocket, type SocketLike } from './socket'

const start: JogStart = {
  type: 'jog_start',
  drive: 'x',
  direction: 1,
  speed: 1,
  acceleration: 1,
  travel_limit: 1,
  torque_limit: 10,
  unit: 'rev',
  press: 0,
}

describe('dead man', () => {
  function make(connected = true) {
    const clock = { now: 0 }
    const sent: {
      type: string
      reason?: string
      press?: number
      sign?: number
      silent_ms?: number
      pressed?: boolean
    }[] = []
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
    expect(sent.at(-1)).toMatchObject({ type: 'jog_stop', reason: 'page-silent' })
    deadMan.beat('x')
    deadMan.tick()
    expect(sent.filter((message) => message.pressed)).toHaveLength(0)
  })
  it('says with every sign how long the page has been silent', () => {
    const { clock, sent, deadMan } = make()
    deadMan.start(start)
    clock.now = 40
    deadMan.beat('x')
    for (clock.now = 80; clock.now <= 400; clock.now += 40) deadMan.tick()
    const signs = sent.filter((message) => message.type === 'jog_renew')
    expect(signs.map((message) => message.silent_ms)).toEqual([
      40, 80, 120, 160, 200, 240, 280, 320, 360,
    ])
    expect(signs.map((message) => message.sign)).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9])
    deadMan.beat('x')
    deadMan.tick()
    expect(sent.at(-1)).toMatchObject({ silent_ms: 0, pressed: true })
  })
  it('releases by a message of its own and by every sign after it', () => {
    const { clock, sent, deadMan } = make()
    deadMan.start(start)
    deadMan.tick()
    deadMan.stop('released')
    expect(sent.at(-1)).toMatchObject({ type: 'jog_stop', press: 1, reason: 'released' })
    deadMan.beat('x')
    for (clock.now = 40; clock.now < RELEASED_MS; clock.now += 40) deadMan.tick()
    const after = sent.slice(3)
    expect(after.length).toBeGreaterThan(10)
    for (const message of after) {
      expect(message).toMatchObject({ type: 'jog_renew', press: 1, pressed: false })
    }
    clock.now = RELEASED_MS + 40
    const count = sent.length
    deadMan.tick()
    expect(sent).toHaveLength(count)
  })
  it('gives a new press a new number, which says nothing of the one before', () => {
    const { sent, deadMan } = make()
    deadMan.start(start)
    deadMan.stop('released')
    deadMan.start(start)
    deadMan.tick()
    expect(sent.at(-2)).toMatchObject({ type: 'jog_start', press: 2 })
    expect(sent.at(-1)).toMatchObject({ type: 'jog_renew', press: 2, sign: 1, pressed: true })
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
