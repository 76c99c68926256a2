import type { JogStop } from '../../api/schema'

/** With the 40 ms between looks the motion ends within 200 ms of the page's last sign of life. */
export const SILENCE_MS = 140

type Send = (
  message:
    | { type: 'enable_press' | 'enable_renew'; invitation: string }
    | { type: 'enable_release'; invitation: string; reason: JogStop['reason'] },
) => boolean

/**
 * The enabling button of the person on site, seen from the worker. As with jog, a sign of life
 * goes out only while the page itself was heard within SILENCE_MS.
 */
export class EnablingHold {
  private invitation: string | null = null
  private heard = 0

  constructor(
    private readonly send: Send,
    private readonly now: () => number,
    /** The hold has ended by itself, not by a release of the page. */
    private readonly lost: () => void = () => {},
  ) {}

  press(invitation: string): void {
    if (this.invitation !== null) this.release('another-guest')
    if (!this.send({ type: 'enable_press', invitation })) return this.lost()
    this.invitation = invitation
    this.heard = this.now()
  }

  beat(): void {
    if (this.invitation === null) return
    // What was silent for too long is not revived.
    if (this.now() - this.heard > SILENCE_MS) this.tick()
    else this.heard = this.now()
  }

  tick(): void {
    if (this.invitation === null) return
    if (this.now() - this.heard > SILENCE_MS) {
      this.release('page-silent')
      this.lost()
    } else if (!this.send({ type: 'enable_renew', invitation: this.invitation })) {
      this.invitation = null
      this.lost()
    }
  }

  release(reason: JogStop['reason']): void {
    if (this.invitation === null) return
    const invitation = this.invitation
    this.invitation = null
    this.send({ type: 'enable_release', invitation, reason })
  }

  ended(): void {
    this.invitation = null
  }
}
