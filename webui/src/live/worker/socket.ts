import { exactJson } from '../../api/exact'
import type { FromPage, ToPage } from '../../api/schema'

/** What the rest needs of a WebSocket; tests bring their own. */
export interface SocketLike {
  binaryType: string
  readyState: number
  onopen: (() => void) | null
  onclose: (() => void) | null
  onmessage: ((event: { data: unknown }) => void) | null
  send(data: string): void
  close(): void
}

export interface LinkState {
  open: boolean
  /** Tries since the connection was lost. */
  attempt: number
  roundTripMs: number | null
}

interface Events {
  state(state: LinkState): void
  message(message: ToPage): void
  block(data: ArrayBuffer): void
  closed(): void
}

const FIRST_DELAY_MS = 250
const GREATEST_DELAY_MS = 4000
/** Whoever holds the control of an axis must be heard within 2 s. */
const PING_MS = 500
const SILENT_MS = 3500
const OPEN = 1

/** Delay before try number `attempt` (from 1): doubles, bounded, with up to 25 % less by chance. */
export function backOff(attempt: number, random: () => number): number {
  const full = Math.min(GREATEST_DELAY_MS, FIRST_DELAY_MS * 2 ** (attempt - 1))
  return full * (1 - 0.25 * random())
}

/** One websocket that comes back by itself and repeats standing requests, never a motion. */
export class LiveSocket {
  private socket: SocketLike | null = null
  private attempt = 0
  private roundTripMs: number | null = null
  private pings = new Map<number, number>()
  private count = 0
  private lastHeard = 0
  private opened = false
  private retry: ReturnType<typeof setTimeout> | null = null
  private readonly standing = new Map<string, FromPage>()

  constructor(
    private readonly make: () => SocketLike,
    private readonly events: Events,
    private readonly now: () => number = () => performance.now(),
  ) {}

  connect(): void {
    if (this.retry !== null) clearTimeout(this.retry)
    this.retry = null
    const socket = this.make()
    this.socket = socket
    this.lastHeard = this.now()
    socket.binaryType = 'arraybuffer'
    socket.onopen = () => {
      this.opened = true
      this.attempt = 0
      this.lastHeard = this.now()
      for (const message of this.standing.values()) socket.send(JSON.stringify(message))
      this.report()
    }
    socket.onmessage = (event) => {
      this.lastHeard = this.now()
      if (event.data instanceof ArrayBuffer) this.events.block(event.data)
      else this.receive(JSON.parse(exactJson(String(event.data))) as ToPage)
    }
    socket.onclose = () => this.lost(socket)
  }

  /** False when there is no open connection: the message is not kept for later. */
  send(message: FromPage): boolean {
    if (!this.opened || this.socket?.readyState !== OPEN) return false
    this.socket.send(JSON.stringify(message))
    return true
  }

  /** A request that holds until it is replaced; repeated after a reconnection. */
  stand(name: string, message: FromPage | null): void {
    if (message === null) this.standing.delete(name)
    else {
      this.standing.set(name, message)
      this.send(message)
    }
  }

  /** Call every second: measures the round trip and notices a dead connection. */
  beat(): void {
    if (!this.opened) {
      if (this.socket && this.now() - this.lastHeard > SILENT_MS) this.abandon(this.socket)
      return
    }
    if (this.now() - this.lastHeard > SILENT_MS && this.socket) {
      this.abandon(this.socket)
      return
    }
    this.count = (this.count + 1) % 1_000_000
    this.pings.set(this.count, this.now())
    this.send({ type: 'ping', n: this.count })
  }

  private receive(message: ToPage): void {
    if (message.type === 'pong') {
      const sent = this.pings.get(message.n)
      this.pings.clear()
      if (sent !== undefined) this.roundTripMs = this.now() - sent
      this.report()
      return
    }
    this.events.message(message)
  }

  private abandon(socket: SocketLike): void {
    // A half-open connection may take minutes to report its own close.
    socket.onclose = null
    socket.onmessage = null
    socket.onopen = null
    try {
      socket.close()
    } finally {
      this.lost(socket)
    }
  }

  private lost(socket: SocketLike): void {
    if (this.socket !== socket) return
    this.socket = null
    this.opened = false
    this.roundTripMs = null
    this.pings.clear()
    this.attempt++
    this.events.closed()
    this.report()
    this.retry = setTimeout(() => this.connect(), backOff(this.attempt, Math.random))
  }

  private report(): void {
    this.events.state({
      open: this.opened,
      attempt: this.attempt,
      roundTripMs: this.roundTripMs,
    })
  }
}

/** Period at which `LiveSocket.beat` is to be called. */
export const BEAT_MS = PING_MS
