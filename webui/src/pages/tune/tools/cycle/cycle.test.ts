import { expect, it } from 'vitest'
import type { CycleResult } from '../../../../api/schema'
import { cycleNotes, cycleRows } from './cycle'

const RESULT = {
  tool: 'cycle',
  verdict: 'overloads',
  period_s: 2,
  duration_s: 60,
  sample_rate_hz: 40,
  rms_percent: 150,
  rms_ci95_percent: [148, 152],
  rated_torque_nm: 2,
  peak_percent: 240,
  peak_limit_percent: 300,
  above_rated_share: 0.5,
  highest_speed_rpm: 600,
  mean_speed_rpm: 500,
  heat: {
    ambient_c: 40,
    time_constant_min: 20,
    rise_share: [1.5, 2.5],
    trip_s: [60, 1200],
    about_s: 300,
  },
  power: null,
  overload: null,
  dc_voltage_v: null,
  drive_load_percent: null,
  findings: [{ code: 'slow_sampling', value: 25, unit: 'ms' }],
} as unknown as CycleResult

const spoken = (name: string, values: Record<string, string> = {}) =>
  [name, ...Object.entries(values).map(([key, value]) => `${key}=${value}`)].join(' ')

it('says the verdict first, then after how many minutes it trips', () => {
  const notes = cycleNotes(RESULT, spoken)
  expect(notes[0]).toEqual({
    words: 'verdict.overloads low=150 high=250 ambient=40',
    tone: 'warn',
  })
  expect(notes.map((each) => each.words)).toContain(
    'trips.between low=1 high=20 about=5 ambient=40',
  )
  expect(notes.at(-1)).toEqual({ words: 'finding.slow_sampling value=25 unit=ms', tone: 'info' })
})

it('does not say that it trips where it may never', () => {
  const heat = { ...RESULT.heat, trip_s: [900, null], about_s: null } as CycleResult['heat']
  const words = cycleNotes({ ...RESULT, heat }, spoken).map((each) => each.words)
  expect(words).toContain('trips.perhaps low=15 ambient=40')
})

it('shows torque in N·m and of the peak', () => {
  const rows = cycleRows(RESULT, spoken)
  expect(rows.find((each) => each.name === 'rms')?.value).toBe(3)
  expect(rows.find((each) => each.name === 'peak_of_limit')?.value).toBe(80)
  expect(rows.find((each) => each.name === 'power')).toBeUndefined()
})
