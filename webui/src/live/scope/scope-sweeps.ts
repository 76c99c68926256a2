import type { Ring, Trace } from './ring'
import { type Sweep, Trigger } from './trigger'
import type { ScopeFrame, ScopeTrigger, TriggerState } from '../worker/worker-messages'

const MOST_SWEEPS = 50
/** Traces that lag by more than this are not waited for when a single picture is complete. */
const LAG_S = 1
/** With no trigger for so long the automatic mode shows what there is. */
const AUTO_S = 0.5

/** What the trigger of the scope has found, and the stretch of time that follows from it. */
export class ScopeSweeps {
  private finder: { trigger: ScopeTrigger; search: Trigger } | null = null
  private found: Sweep[] = []
  private count = 0
  private armedAt = 0
  private reported: TriggerState = 'off'

  /** `changed` hears what the trigger is up to, whenever that changes. */
  constructor(private readonly changed: (state: TriggerState) => void) {}

  /** Look for this from now on, the newest sample of all; null looks for nothing. */
  arm(trigger: ScopeTrigger | null, now: number, ring: Ring | null | undefined): void {
    this.forget()
    this.armedAt = now
    this.finder = trigger && {
      trigger,
      search: new Trigger(trigger.settings, ring?.newest ?? now, ring?.begun),
    }
    this.tell()
  }

  forget(): void {
    this.found = []
    this.count = 0
  }

  /** Look through what is new of the trace that triggers. */
  look(find: (id: string) => Trace | null): void {
    if (!this.finder) return
    const { trigger, search } = this.finder
    const trace = find(trigger.id)
    if (!trace || (trigger.mode === 'single' && this.found.length > 0)) return
    for (let sweep = search.look(trace); sweep; sweep = search.look(trace)) {
      this.found.push(sweep)
      this.count++
      if (trigger.mode === 'single') break
    }
    this.found = this.found.slice(-Math.min(MOST_SWEEPS, trigger.persistence + 1))
    this.tell()
  }

  private tell(): void {
    const state = !this.finder ? 'off' : this.found.length === 0 ? 'waiting' : 'triggered'
    if (state !== this.reported) this.changed(state)
    this.reported = state
  }

  /** Whether the one picture that was wanted is there, of all traces that bring anything. */
  caught(newest: number | null, rings: Iterable<{ ring: Ring }>): boolean {
    const [sweep] = this.found
    if (this.finder?.trigger.mode !== 'single' || !sweep) return false
    if ((newest ?? 0) > sweep.to + LAG_S) return true
    return [...rings].every(({ ring }) => ring.newest === null || ring.newest >= sweep.to)
  }

  /** Sweeps before the newest one, oldest first. */
  get earlier(): Sweep[] {
    return this.found.slice(0, -1)
  }

  state(newest: number | null): ScopeFrame['trigger'] {
    const at = this.found.at(-1)?.at ?? null
    const count = this.count
    if (!this.finder) return { state: 'off', at: null, count }
    if (this.free(newest)) return { state: 'auto', at: null, count }
    return { state: at === null ? 'waiting' : 'triggered', at, count }
  }

  /** Whether the automatic mode shows what there is, for want of a trigger. */
  private free(newest: number | null): boolean {
    if (this.finder?.trigger.mode !== 'auto' || newest === null) return false
    const last = this.found.at(-1)?.to ?? this.armedAt
    // Earlier than the last one: the clock is another one since.
    return newest < last || newest - last > Math.max(AUTO_S, this.finder.trigger.settings.window)
  }

  /** The stretch to show: the newest seconds, or what the trigger found. */
  shown(
    show: { window: number } | { trigger: 'newest' },
    newest: number | null,
  ): { from: number; to: number } {
    const end = newest ?? 0
    if ('window' in show) return { from: end - show.window, to: end }
    const window = this.finder?.trigger.settings.window ?? 1
    if (this.free(newest)) return { from: end - window, to: end }
    // Until the first trigger: what would lie before it if it came now.
    const before = window * (this.finder?.trigger.settings.before ?? 0)
    return this.found.at(-1) ?? { from: end - before, to: end - before + window }
  }
}
