import { channelsOf, compile, type Node, parse, type Step } from './expression'
import { Ring, Trace } from '../ring'

/**
 * A computed channel. It has the times of the first channel that its text names; the others are
 * interpolated on the straight line between their samples, so it waits for them.
 */
export class MathsChannel {
  readonly trace: Trace
  private readonly tree: Node
  private step: Step
  private readonly names: string[]
  private done = Number.NEGATIVE_INFINITY
  /** Of the channel that gives the times, when the last sample of it was taken. */
  private begun: number | null = null

  /** Throws ExpressionError; a text without any channel has no times and gives nothing. */
  constructor(
    expression: string,
    capacity: number,
    private readonly find: (name: string) => Trace | null,
  ) {
    this.tree = parse(expression)
    this.names = channelsOf(this.tree)
    this.step = compile(this.tree)
    this.trace = new Trace(new Ring(capacity))
  }

  /** Compute what the channels allow by now. */
  advance(): void {
    const inputs = new Map<string, Trace>()
    for (const name of this.names) {
      const trace = this.find(name)
      if (!trace) return
      inputs.set(name, trace)
    }
    const base = inputs.get(this.names[0] ?? '')
    if (!base) return
    if (base.ring.begun !== this.begun) {
      // Its clock is another one: what was computed by the former has nothing to do with it.
      if (this.begun !== null) {
        this.step = compile(this.tree)
        this.trace.ring.clear()
      }
      this.begun = base.ring.begun
      this.done = Number.NEGATIVE_INFINITY
    }
    const until = Math.min(...[...inputs.values()].map(({ ring }) => ring.newest ?? this.done))
    const { ring } = base
    for (let row = ring.firstAfter(this.done); row < ring.length; row++) {
      const time = ring.time(row)
      if (time > until) return
      this.done = time
      const value = this.step(time, (name) => {
        const trace = inputs.get(name) as Trace
        return trace === base ? base.value(row) : trace.between(time)
      })
      this.trace.ring.push(time, Number.isFinite(value) ? value : Number.NaN)
    }
  }
}
