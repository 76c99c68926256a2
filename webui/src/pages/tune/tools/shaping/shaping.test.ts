import { expect, it } from 'vitest'
import type { ShapingResult } from '../../../../api/schema'
import { shapingNotes, shapingRows, shapingTables } from './shaping'

const RESULT = {
  tool: 'shaping',
  verdict: 'verified',
  signal: 'torque',
  unit: '%',
  chosen: 'zv',
  mode: {
    frequency_hz: 8,
    frequency_ci95_hz: [7.9, 8.1],
    damping: 0.02,
    damping_ci95: [0.01, 0.03],
    range_hz: [7.8, 8.2],
    range_damping: [0.01, 0.03],
    ring_downs: 4,
    explained: 0.9,
  },
  shapers: [
    {
      kind: 'zv',
      impulses: [
        { share: 0.52, time_s: 0 },
        { share: 0.48, time_s: 0.0625 },
      ],
      delay_s: 0.0625,
      residual_percent: [0, 3.25],
      tolerated_hz: [7.75, 8.25],
    },
  ],
  comparison: {
    unit: '%',
    moves: 4,
    unshaped: 10,
    unshaped_ci95: [9, 11],
    shaped: 1,
    shaped_ci95: [0.5, 1.5],
    ratio: 0.1,
    watched_s: 2,
    settling_window: 1,
    settling_unit: '%',
    settling_unshaped_s: null,
    settling_shaped_s: 0.2,
    settling_ratio: 0.1,
    residuals: [],
  },
  drive_values: [{ parameter: 'P09.26', name: 'Frequency', raw: 80, value: 8, unit: 'Hz' }],
  findings: [{ code: 'wide_mode', value: 6, unit: '%', parameter: '' }],
} as unknown as ShapingResult

const spoken = (name: string, values: Record<string, string> = {}) =>
  [name, ...Object.entries(values).map(([key, value]) => `${key}=${value}`)].join(' ')

it('states the verdict first, with what is left and both settling times', () => {
  const notes = shapingNotes(RESULT, spoken)
  expect(notes[0]).toEqual({
    words: 'verdict.verified shaper=ZV residual=10 before=> 2 s after=0.2 s',
    tone: 'good',
  })
  expect(notes[1]).toEqual({ words: 'finding.wide_mode value=6 unit=% parameter=', tone: 'warn' })
})

it('warns where a shaper does not help', () => {
  expect(shapingNotes({ ...RESULT, verdict: 'no_better' }, spoken)[0]?.tone).toBe('warn')
})

it('has no rows for what was not compared', () => {
  const rows = shapingRows({ ...RESULT, comparison: null }, spoken)
  expect(rows.map((each) => each.name)).toEqual(['frequency', 'damping', 'ring_downs', 'explained'])
  expect(shapingRows(RESULT, spoken).find((each) => each.name === 'ratio')?.value).toBe(10)
})

it('lists the impulses of each shaper, and the values of the drive', () => {
  const [shapers, drive] = shapingTables(RESULT, spoken, (name) => name)
  expect(shapers?.rows).toEqual([
    ['chosen shaper=ZV', '52.00 / 48.00', '0.0 / 62.5', '0.0–3.3', '7.75–8.25'],
  ])
  expect(drive?.rows).toEqual([['named parameter=P09.26 name=Frequency', '8\u00a0Hz']])
  const [, chinese] = shapingTables(RESULT, spoken, (name) => ({ Frequency: '频率' })[name] ?? name)
  expect(chinese?.rows[0]?.[0]).toBe('named parameter=P09.26 name=频率')
})
