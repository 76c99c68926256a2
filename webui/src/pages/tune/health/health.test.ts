import { describe, expect, it } from 'vitest'
import type { AxisHealth, HealthRunInfo } from '../../../api/schema'
import { seriesOf, signable } from './health'

const run = (id: number, files: string[], friction: number): HealthRunInfo => ({
  id,
  station: 'hall 3',
  taken: `2026-01-0${id}T00:00:00Z`,
  person: 'Ann',
  comparable: true,
  measurements: files,
  missing: [],
  values: [
    { quantity: 'friction', number: 1, value: friction, low: friction - 1, high: null },
    { quantity: 'resonance', number: 2, value: 60, low: null, high: null },
  ],
})
const health = (runs: HealthRunInfo[]): AxisHealth => ({
  key: 'k',
  axis: 'X',
  profile: 'mms7',
  serial: 7,
  baseline: null,
  findings: [],
  changed: 0,
  suspected: 0,
  other_settings: 0,
  runs,
})

describe('the condition of an axis', () => {
  it('has a series for each quantity, an unknown end being the value', () => {
    const [friction, resonance] = seriesOf([run(1, ['a'], 8), run(2, ['b'], 9)])
    expect(friction?.value).toEqual([8, 9])
    expect(friction?.low).toEqual([7, 8])
    expect(friction?.high).toEqual([8, 9])
    expect((friction?.time[1] ?? 0) - (friction?.time[0] ?? 0)).toBe(86400)
    expect(resonance?.name).toBe('resonance 2')
  })

  it('is signed from three rounds of one check or more', () => {
    expect(signable(health([]))).toEqual([])
    const two = [run(1, ['a'], 8), run(2, ['b'], 8), run(3, ['b'], 8)]
    expect(signable(health(two))).toEqual([])
    expect(signable(health([...two, run(4, ['b'], 8)]))).toEqual([2, 3, 4])
  })
})
