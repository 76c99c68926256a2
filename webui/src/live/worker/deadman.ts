import type { JogRenew, JogStart, JogStop } from '../../api/schema'

/** Time between signs of life sent. */
export const RENEW_MS = 40
/**
 * How long the page may be silent before the hold ends for good, as the server has it too. The
 * axis brakes much earlier: each sign says how long the page has been silent.
 */
export const SILENCE_MS = 500
/** How long after a release each further sign still says that the button is not pressed. */
export const RELEASED_MS = 600

type Send = (
  message:
    | JogStart
    | (Omit<JogRenew, 'sent_ms' | 'sign'> & { sent_ms: number; sign: number })
    | { type: 'jog_stop'; drive: string; press: number; reason: JogStop['reason'] },
) => boolean

/**
 * The held button, seen from the worker, whose timers a busy page cannot delay.
 *
 * Timers of a worker run on when the page is hidden or frozen, so they prove nothing about the
 * person. Each sign therefore says how long the page itself has not been heard, and after
 * SILENCE_MS the jog is stopped; a later beat does not revive it. A release goes out as a message
 * of its own and with every sign after it.
 */
export class DeadMan {
  private drive: string | null = null
  private heard = 0
  private press = 0
  private sign = 0
  /** What was released last, and until when it is repeated. */
  private released: { drive: string; press: number; until: number } | null = null

  constructor(
    private readonly send: Send,
    private readonly now: () => number,
  ) {}

  get held(): string | null {
    return this.drive
  }

  /** False when the message could not be sent; nothing is held then. */
  start(message: JogStart): boolean {
    if (this.drive !== null) this.stop('another-jog')
    this.press += 1
    this.sign = 0
    this.released = null
    if (!this.send({ ...message, press: this.press })) return false
    this.drive = message.drive
    this.heard = this.now()
    return true
  }

  /** The page is alive and its button is still held. */
  beat(drive: string): void {
    if (this.drive !== drive) return
    if (this.now() - this.heard > SILENCE_MS) this.tick()
    else this.heard = this.now()
  }

  /** Call every RENEW_MS. */
  tick(): void {
    if (this.drive === null) return this.repeatRelease()
    const silent = this.now() - this.heard
    if (silent > SILENCE_MS) this.stop('page-silent')
    else if (!this.give(this.drive, this.press, true, silent)) this.drive = null
  }

  stop(reason: JogStop['reason']): void {
    if (this.drive === null) return
    const drive = this.drive
    this.drive = null
    this.released = { drive, press: this.press, until: this.now() + RELEASED_MS }
    this.send({ type: 'jog_stop', drive, press: this.press, reason })
  }

  /** The server ended it, or the socket is gone. */
  ended(): void {
    this.drive = null
    this.released = null
  }

  private repeatRelease(): void {
    if (this.released === null) return
    if (this.now() > this.released.until) this.released = null
    else this.give(this.released.drive, this.released.press, false, 0)
  }

  private give(drive: string, press: number, pressed: boolean, silent: number): boolean {
    this.sign += 1
    return this.send({
      type: 'jog_renew',
      drive,
      press,
      sign: this.sign,
      sent_ms: this.now(),
      silent_ms: silent,
      pressed,
    })
  }
}
