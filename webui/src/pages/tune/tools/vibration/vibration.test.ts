import { expect, test } from 'vitest'
import type { DwellResult, VibrationResult } from '../../../../api/schema'
import { dwellRows, levelCurves, vibrationNotes, vibrationRows, vibrationTables } from './vibration'

const MAP = {
  tool: 'vibration',
  orders: [
    {
      order_per_rev: 24.0004,
      order_ci95: [23.998, 24.003],
      place: 'whole',
      largest_rpm: 2.5,
      at_rpm: 505,
      torque_percent: 1.2,
      level_speed_rpm: [505, 300],
      level_rpm: [2.5, 0.4],
    },
  ],
  frequencies: [],
  resonances: [
    {
      frequency_hz: 202,
      frequency_ci95_hz: [199, 205],
      avoid: [{ order_per_rev: 24, speed_rpm: 505, low_rpm: 460.04, high_rpm: 551 }],
    },
  ],
  findings: [{ code: 'resonance', value: 202, unit: 'Hz' }, { code: 'motor_side' }],
} as unknown as VibrationResult

const DWELL = {
  tool: 'dwell',
  by: 'torque',
  excitation: 8,
  speed_rpm: { value: 12, ci95: [11, 13] },
  position_deg: { value: 0.2, ci95: [0.1, 0.3] },
  torque_percent: { value: 7, ci95: [6, 8] },
  phase_deg: null,
  harmonics: [{ multiple: 2, speed_rpm: 0.1, speed_ci95_rpm: [0, 0.2] }],
  over_s: 3,
  findings: [],
} as unknown as DwellResult

const text = (name: string, values: Record<string, string> = {}) =>
  [name, ...Object.values(values)].filter(Boolean).join(' ')

test('a resonance is a warning with its frequency', () => {
  expect(vibrationNotes(MAP.findings, text)).toEqual([
    { words: 'finding.resonance 202 Hz', tone: 'warn' },
    { words: 'finding.motor_side', tone: 'info' },
  ])
  expect(vibrationRows(MAP, text)).toEqual([
    { name: 'resonance', value: 202, unit: 'Hz', ends: [199, 205] },
  ])
})

test('speeds to avoid and orders have a table each, an empty one is left out', () => {
  const [avoid, orders] = vibrationTables(MAP, text)
  expect(avoid?.rows).toEqual([['202', '24', '505', '460–551']])
  expect(orders?.rows[0]).toEqual(['24', '23.998–24.003', '2.5', '1.2', '505', 'place.whole'])
  expect(vibrationTables({ ...MAP, resonances: [] }, text)).toHaveLength(1)
})

test('levels are in order of the speed', () => {
  expect(levelCurves(MAP)).toEqual([{ label: '24', x: [300, 505], y: [0.4, 2.5] }])
})

test('a phase that cannot be known has no value', () => {
  const rows = new Map(dwellRows(DWELL, text).map((row) => [row.name, row]))
  expect(rows.get('excitation')).toMatchObject({ value: 8, unit: '%' })
  expect(rows.get('phase')).toMatchObject({ value: null, ends: null })
  expect(rows.get('harmonic 2')).toMatchObject({ value: 0.1, ends: [0, 0.2] })
})
