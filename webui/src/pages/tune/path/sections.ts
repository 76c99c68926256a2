import { useState } from 'react'
import { nextStep, type StepName } from './path'

/** What opens and folds on the page: the steps, and the groups that they stand in. */
export type Section = StepName | 'first' | 'automatic' | 'manual' | 'more'

/** Steps that are done one by one, instead of *Tune automatically*. */
const MANUAL = ['inertia', 'response', 'notches', 'gains', 'verify'] as const
const isManual = (step: Section): boolean => (MANUAL as readonly Section[]).includes(step)

/**
 * What is open when the page is opened: the present step. *Tune automatically* stands for the
 * steps 2 to 6 until one of them was done by hand; a manual step is open with its group.
 */
export function present(
  done: Record<StepName, boolean>,
  axis: {
    /** Whether this axis can be tuned automatically. */
    automatic: boolean
    /** The job of a step that runs now. */
    running: Section | null
    /** Whether the newest automatic tuning has a verdict, which can be undone there. */
    tuned: boolean
  },
): Section[] {
  const next = axis.running ?? nextStep(done)
  if (next === null) return []
  const verdict = axis.tuned && axis.running === null ? (['automatic'] as const) : []
  if (!isManual(next)) return [...verdict, next]
  const begun = MANUAL.some((step) => done[step])
  return axis.running === null && axis.automatic && !begun
    ? ['automatic']
    : [...verdict, 'manual', next]
}

/**
 * Which sections are open. They follow the present step until somebody touches one of them;
 * from then on nothing opens or folds by itself under a finger.
 */
export function useSections(now: Section[]) {
  const [kept, setKept] = useState<Section[] | null>(null)
  const open = kept ?? now
  return {
    isOpen: (name: Section) => open.includes(name),
    /** Somebody touched the page: what is open now stays open. */
    keep: () => setKept((before) => before ?? now),
    /** Open a section with the group that it stands in, or fold it. */
    set: (name: Section, wanted: boolean) =>
      setKept((before) => {
        const others = (before ?? now).filter((each) => each !== name)
        if (!wanted) return others
        return [...others, name, ...(isManual(name) ? (['manual'] as const) : [])]
      }),
  }
}
