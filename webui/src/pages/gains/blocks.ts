import type { GainBlock } from '../../api/schema'

/** Order of the page: what one sets first comes first. */
const ORDER: GainBlock['block'][] = [
  'level',
  'inertia',
  'position',
  'speed',
  'switching',
  'speed_ff',
  'torque_ff',
  'torque_filter',
  'notch',
  'adaptive',
  'feedback_filter',
  'command_filter',
  'compensation',
  'current',
  'limits',
]

/** Blocks with their parts, gain sets in order, without what no port can reach. */
export function grouped(
  blocks: readonly GainBlock[],
  reachable: ReadonlySet<string>,
): { block: GainBlock['block']; parts: GainBlock[] }[] {
  return ORDER.flatMap((block) => {
    const parts = blocks
      .filter((each) => each.block === block && each.keys.some((key) => reachable.has(key)))
      .toSorted((a, b) => (a.set_number ?? 9) - (b.set_number ?? 9))
    return parts.length > 0 ? [{ block, parts }] : []
  })
}
