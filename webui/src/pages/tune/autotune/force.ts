/**
 * Whether a design that was applied still acts: whoever changes a gain later makes it another.
 * Kept: nothing was written, as what the axis had is better than every design.
 */
export type Force = 'acts' | 'kept' | 'takenBack' | 'changed'

/**
 * By the gains that the drive holds now (raw values by key); what is not among them says nothing.
 */
export function forceOf(
  before: Record<string, number>,
  after: Record<string, number>,
  now: Record<string, number>,
): Force {
  if (Object.keys(before).length === 0) return 'kept'
  const keys = Object.keys(after).filter((key) => key in now)
  if (keys.every((key) => now[key] === after[key])) return 'acts'
  return keys.every((key) => now[key] === before[key]) ? 'takenBack' : 'changed'
}
