import type { AxisHealth, HealthFinding, HealthRunInfo } from '../../../api/schema'

/** Rounds that a baseline takes at least, as in `backend/tools/watching/trend/compare.py`. */
export const LEAST_ROUNDS = 3
/** Rounds of a check that is compared. */
export const CHECK_ROUNDS = 2

export interface Series {
  name: string
  quantity: HealthFinding['quantity']
  number: number
  /** Seconds since the epoch. */
  time: number[]
  value: number[]
  low: number[]
  high: number[]
}

/** What was measured over time, by quantity and number, in the order of their first appearance. */
export function seriesOf(runs: HealthRunInfo[]): Series[] {
  const found = new Map<string, Series>()
  for (const run of runs) {
    const time = Date.parse(run.taken) / 1000
    for (const each of run.values) {
      const number = each.number ?? 1
      const name = `${each.quantity} ${number}`
      const series = found.get(name) ?? {
        name,
        quantity: each.quantity,
        number,
        time: [],
        value: [],
        low: [],
        high: [],
      }
      series.time.push(time)
      series.value.push(each.value)
      series.low.push(each.low ?? each.value)
      series.high.push(each.high ?? each.value)
      found.set(name, series)
    }
  }
  return [...found.values()]
}

/** The rounds that can be signed as a baseline: those of the newest check, or the newest three. */
export function signable(health: AxisHealth): number[] {
  const newest = health.runs.at(-1)
  if (!newest) return []
  const files = newest.measurements.join('\n')
  const alike = health.runs.filter((each) => each.measurements.join('\n') === files)
  return alike.length >= LEAST_ROUNDS ? alike.map((each) => each.id) : []
}

/** Colour of a finding's note. */
export function toneOf(finding: HealthFinding): 'warn' | 'good' | 'info' {
  if (finding.code === 'changed' || finding.code === 'not_seen') return 'warn'
  return finding.code === 'same' ? 'good' : 'info'
}

/** What is known of an axis against its baseline, in one word. */
export function stateOf(
  health: AxisHealth,
): 'none' | 'wrong' | 'changed' | 'suspected' | 'same' | 'open' {
  if (!health.baseline) return 'none'
  if (!health.baseline.intact) return 'wrong'
  if (health.changed > 0) return 'changed'
  if (health.suspected > 0) return 'suspected'
  const judged = health.findings.filter((each) => each.looked_for !== null)
  return judged.length > 0 && judged.every((each) => each.code === 'same') ? 'same' : 'open'
}
