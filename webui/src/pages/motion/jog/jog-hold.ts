import type { JogStop } from '../../../api/schema'

/**
 * After so long without a beat the page was too busy to see a release. Only a drawn frame counts
 * then: the input that waited meanwhile is dealt with before one is drawn.
 */
export const BUSY_MS = 120

interface Port {
  start(direction: -1 | 1): void
  beat(): void
  stop(reason: JogStop['reason']): void
  /** Called with the direction, or null, whenever it changes. */
  changed(direction: -1 | 1 | null): void
}

/** The parts of a window that matter, so that a test can bring its own. */
interface Surroundings {
  isVisible(): boolean
  hasFocus(): boolean
  requestFrame(callback: () => void): number
  cancelFrame(id: number): void
  /** Milliseconds since any moment. */
  now(): number
}

/**
 * One held button. While it is held, every drawn frame sends a beat, and so does every answer to
 * the worker, which asks whether it is; a page that is hidden, frozen, covered or unfocused does
 * neither or is refused here, and the worker then stops the jog.
 */
export class JogHold {
  private direction: -1 | 1 | null = null
  private frame = 0
  private beaten = 0

  constructor(
    private readonly port: Port,
    private readonly around: Surroundings,
  ) {}

  get held(): -1 | 1 | null {
    return this.direction
  }

  press(direction: -1 | 1): boolean {
    if (this.direction !== null) {
      // Two buttons at once is no clear wish: stop.
      this.release('another-key')
      return false
    }
    if (!this.around.isVisible() || !this.around.hasFocus()) return false
    this.direction = direction
    this.beaten = this.around.now()
    this.port.start(direction)
    this.port.changed(direction)
    this.next()
    return true
  }

  release(reason: JogStop['reason']): void {
    if (this.direction === null) return
    this.around.cancelFrame(this.frame)
    this.direction = null
    this.port.stop(reason)
    this.port.changed(null)
  }

  /** The worker asks: a page that draws no frame for a moment, as its plots are large, is alive. */
  asked(): void {
    if (this.direction === null || this.around.now() - this.beaten > BUSY_MS) return
    this.beat()
  }

  private beat(): void {
    if (!this.around.isVisible()) return this.release('page-hidden')
    if (!this.around.hasFocus()) return this.release('focus-lost')
    this.beaten = this.around.now()
    this.port.beat()
  }

  private next(): void {
    this.frame = this.around.requestFrame(() => {
      if (this.direction === null) return
      this.beat()
      if (this.held !== null) this.next()
    })
  }
}
