import type { AxisState, JobInfo } from '../../api/schema'
import { keep, kept } from '../../widgets/browser/kept'
import type { AxisPage } from '../navigation/router'

/** The steps of the guided tour, in order. */
export const STEPS = ['look', 'jog', 'response', 'tune', 'fault', 'undo', 'end'] as const
export type Step = (typeof STEPS)[number]

/** The page on which a step is done. */
export const PAGE: Record<Step, AxisPage> = {
  look: 'overview',
  jog: 'motion',
  response: 'response',
  tune: 'tune',
  fault: 'alarms',
  undo: 'tune',
  end: 'overview',
}

/** The job that completes a step, by its kind. A jog counts however it ended. */
const JOB: Partial<Record<Step, { kind: string; states: string[] }>> = {
  jog: { kind: 'jog', states: ['done', 'cancelled'] },
  response: { kind: 'sweep', states: ['done'] },
  tune: { kind: 'autotune', states: ['done'] },
}

/** What is compared with the present to see whether somebody has done the step. */
export interface Before {
  /** Jobs that had been started before the step was shown. */
  jobs: ReadonlySet<string>
  /** Changes that had been undone before the step was shown. */
  undone: number
  /** Whether a fault has been active since the step was shown. */
  faulty: boolean
}

/** Whether somebody has done what a step asks for. */
export function isDone(
  step: Step,
  axis: string,
  before: Before,
  now: { jobs: Iterable<JobInfo>; undone: number; state: AxisState | null },
): boolean {
  const job = JOB[step]
  if (job) {
    for (const each of now.jobs) {
      const fits = each.kind === job.kind && each.drive === axis && job.states.includes(each.state)
      if (fits && !before.jobs.has(each.id)) return true
    }
    return false
  }
  if (step === 'undo') return now.undone > before.undone
  if (step === 'fault') return before.faulty && now.state !== null && !isFaulty(now.state)
  return false
}

export const isFaulty = (state: AxisState): boolean =>
  !state.fresh || state.state.startsWith('Fault') || state.faults.length > 0

/** Where the tour is: null before it was offered, a step, or left. */
export type Place = Step | 'offer' | 'left'

const STORED = 'servodeck.tour'

/** The place that this browser remembers; a new browser is offered the tour. */
export function storedPlace(): Place {
  const found = kept(STORED)
  if (found === 'left') return 'left'
  return STEPS.find((each) => each === found) ?? 'offer'
}

export function storePlace(place: Place): void {
  keep(STORED, place)
}
