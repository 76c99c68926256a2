import type { TerminalInfo } from '../../api/schema'

/** Names of terminals that have this function already; by name, as codes differ per terminal. */
export function twins(terminals: TerminalInfo[], of: TerminalInfo, code: number): string[] {
  const name = of.functions.find((each) => each.code === code)?.name
  if (!name || UNUSED.has(name)) return []
  return terminals
    .filter((each) => each.name !== of.name && each.function_name === name)
    .map((each) => each.name)
}

const UNUSED = new Set(['not used', 'none', 'no function', 'no function selection', 'OFF', 'ON'])

/** "DI1 normally open (0: normally closed)" names both values of the bit, in either language. */
export function polarityName(label: string | undefined, value: 0 | 1): string | null {
  const match = /^\S+ (normally \w+|常[开闭])[ ]?[（(]0[：:] ?(normally \w+|常[开闭])[)）]$/.exec(
    label ?? '',
  )
  return match ? (match[value === 1 ? 1 : 2] ?? null) : null
}
