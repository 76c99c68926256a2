import type { Quality } from '../../../api/schema'

/** The pictures of the segment show these, and a counter above shows the repeats. */
const SHOWN_ELSEWHERE = /^(cyclic_(?!bus_load)|late_below_|mailbox_repeats$)/
const UNITS: Record<string, string> = { us: 'µs', ms: 'ms', percent: '%', hz: 'Hz' }
const FIXED: Record<string, string> = { baudrate: 'Bd' }

/** One figure of a link for people: the unit apart from the name, which is never a variable's. */
interface Figure {
  name: string
  words: string
  value: string
  unit: string
}

export function figures(details: Quality['details']): Figure[] {
  return Object.entries(details)
    .filter(([name]) => !SHOWN_ELSEWHERE.test(name))
    .map(([name, value]) => {
      const suffix = /_([a-z]+)$/.exec(name)?.[1] ?? ''
      const unit = UNITS[suffix]
      const plain = unit ? name.slice(0, -suffix.length - 1) : name
      return {
        name,
        words: plain.replaceAll('_', ' '),
        value: String(value),
        unit: unit ?? FIXED[name] ?? '',
      }
    })
}
