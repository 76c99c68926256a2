import type { JogStart } from '../api/schema'

/** Least time between renewals sent, and how long the page may be silent. */
export const RENEW_MS = 40
export const SILENCE_MS = 100

type Send = (
  message:
    | JogStart
    | { type: 'jog_renew'; drive: string }
    | { type: 'jog_stop'; drive: string; reason: string },
) => boolean

/**
 * The held button, seen from the worker.
 *
 * A worker's timers run on when the page is hidden or frozen, so they prove nothing about the
 * person. Renewals are therefore sent only while the page itself was heard within SILENCE_MS;
 * after that the jog is stopped, and a later beat does not revive it.
 */
export class DeadMan {
  private drive: string | null = null
  private heard = 0

  constructor(
    private readonly send: Send,
    private readonly now: () => number,
  ) {}

  get held(): string | null {
    return this.drive
  }

  /** False when the message could not be sent; nothing is held then. */
  start(message: JogStart): boolean {
    if (this.drive !== null) this.stop('another jog began')
    if (!this.send(message)) return false
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
    if (this.drive === null) return
    if (this.now() - this.heard > SILENCE_MS) this.stop('the page fell silent')
    else if (!this.send({ type: 'jog_renew', drive: this.drive })) this.drive = null
  }

  stop(reason: string): void {
    if (this.drive === null) return
    const drive = this.drive
    this.drive = null
    this.send({ type: 'jog_stop', drive, reason })
  }

  /** The server ended it, or the socket is gone. */
  ended(): void {
    this.drive = null
  }
}
