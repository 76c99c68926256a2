import { expect, test } from 'vitest'
import type { LoadSideResult } from '../../../../api/schema'
import { loadSideNotes, loadSideRows } from './loadSide'

const RESULT = {
  tool: 'load-side',
  counts_per_load_rev: -131072,
  lost_motion_deg: { value: 0.25, ci95: [0.24, 0.26] },
  backlash_deg: { value: 0.23, ci95: [0.22, 0.24] },
  backlash_motor_rev: { value: 0.00064, ci95: [0.0006, 0.0007] },
  stiffness_nm_per_rad: { value: 60, ci95: [56, 64] },
  stiffness_at_least_nm_per_rad: null,
  locked_motor_hz: null,
  load_inertia_kgm2: null,
  error_span_deg: { value: 0.1, ci95: [0.09, 0.11] },
  error_orders: [{ order_per_rev: 1, amplitude_deg: 0.05, amplitude_ci95_deg: [0.04, 0.06] }],
  findings: [{ code: 'measured', value: 0.23, unit: '°' }, { code: 'motor_inertia_unknown' }],
} as unknown as LoadSideResult

const text = (name: string, values: Record<string, string> = {}) =>
  [name, ...Object.values(values)].filter(Boolean).join(' ')

test('the verdict has its figure, what is not known is named beside it', () => {
  expect(loadSideNotes(RESULT, text)).toEqual([
    { words: 'finding.measured 0.23 °', tone: 'good' },
    { words: 'finding.motor_inertia_unknown', tone: 'info' },
  ])
})

test('each figure has its interval, and a dash where it cannot be known', () => {
  const rows = new Map(loadSideRows(RESULT, text).map((row) => [row.name, row]))
  expect(rows.get('backlash')).toMatchObject({ value: 0.23, unit: '°', ends: [0.22, 0.24] })
  expect(rows.get('locked_motor')).toMatchObject({ value: null, ends: null })
  expect(rows.get('order 1')).toMatchObject({ value: 0.05 })
})

test('a coupling that is too stiff has its least stiffness', () => {
  const stiff = {
    ...RESULT,
    stiffness_nm_per_rad: null,
    stiffness_at_least_nm_per_rad: 900,
  }
  const rows = loadSideRows(stiff, text)
  expect(rows.map((row) => row.name)).not.toContain('stiffness')
  expect(rows.find((row) => row.name === 'stiffness_least')?.value).toBe(900)
})
