import type { MeasurementInfo } from '../../../api/schema'

/** The steps of *Tune automatically* (`autotune.*` of the catalogue), and the report after them. */
export const STEPS = [
  'checks',
  'inertia',
  'response',
  'notches',
  'gains',
  'verify',
  'report',
] as const
export type StepName = (typeof STEPS)[number]

/** What is known of the axis when the path is drawn. */
export interface Known {
  ready: boolean
  inertia: boolean
  /** When a change was written last, as the page remembers it; null: never. */
  changed: string | null
  /** Usable measurements of this axis, newest first. */
  measured: Pick<MeasurementInfo, 'kind' | 'saved'>[]
  /** When a report was made last. */
  reported: string | null
}

const newest = (known: Known, kinds: string[]): string | null =>
  known.measured.find((each) => kinds.includes(each.kind))?.saved ?? null
const after = (time: string | null, other: string | null) =>
  time !== null && (other === null || Date.parse(time) >= Date.parse(other))

/** Which steps of the path are done: measured, written, and verified since the last change. */
export function stepsDone(known: Known): Record<StepName, boolean> {
  const verified = newest(known, ['sweep-speed_loop', 'sweep-position_loop'])
  const changed = known.changed
  const done = {
    checks: known.ready,
    inertia: known.inertia || newest(known, ['inertia']) !== null,
    gains: changed !== null,
    response: newest(known, ['sweep-mechanics']) !== null,
    notches: changed !== null && newest(known, ['sweep-mechanics']) !== null,
    // A loop that was measured before anything was written verifies nothing.
    verify: changed !== null && after(verified, changed),
  }
  return { ...done, report: done.verify && after(known.reported, verified) }
}

/** The first step that is not done; null at the end of the path. */
export const nextStep = (done: Record<StepName, boolean>): StepName | null =>
  STEPS.find((each) => !done[each]) ?? null

/**
 * When a tuning wrote its design; null where it did not. One that was verified measured after that,
 * so that its verification is of it.
 */
export const tunedAt = (
  tuned: { applied: unknown; verified: unknown },
  job: { started: string; ended: string | null },
): string | null => (!tuned.applied ? null : tuned.verified ? job.started : job.ended)

/** The later of two times; null is before all. */
export function later(a: string | null, b: string | null): string | null {
  if (a === null || b === null) return a ?? b
  return Date.parse(a) > Date.parse(b) ? a : b
}
