/**
 * Answers that are waited for, so that a page can show when it has what it asked for on opening.
 */
const open = new Set<number>()
let last = 0

/** The same promise, counted until it has ended. */
export async function counted<T>(answer: Promise<T>): Promise<T> {
  const number = ++last
  open.add(number)
  try {
    return await answer
  } finally {
    open.delete(number)
  }
}

/** This moment, for `outstanding`. */
export function moment(): number {
  return last
}

/** Whether anything that was asked since then is without an answer. */
export function outstanding(since: number): boolean {
  for (const number of open) if (number > since) return true
  return false
}
