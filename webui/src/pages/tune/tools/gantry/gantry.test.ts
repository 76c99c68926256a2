import { expect, test } from 'vitest'
import type { AxisState, DriveSummary, GantryResult } from '../../../../api/schema'
import { candidatesOf, couplingCurve, gantryNotes, gantryRows, motionCurves } from './gantry'

const SEGMENT = 'ethercat://eth0'

const drive = (id: string, url = SEGMENT, holder: string | null = null) =>
  ({
    id,
    name: id.toUpperCase(),
    pending: 0,
    lease: { holder, mine: false },
    ports: [{ kind: url.split(':')[0], url }],
  }) as unknown as DriveSummary

const state = (changes: Partial<AxisState> = {}) =>
  ({ fresh: true, faults: [], moving_job: null, modes: [8, 9, 10], ...changes }) as AxisState

test('the partner is an axis of the same segment that may be moved, the others have a reason', () => {
  const found = candidatesOf(drive('a'), [
    [drive('a'), state()],
    [drive('other', 'ethercat://eth1'), state()],
    [drive('can', 'canopen://can0'), state()],
    [drive('held', SEGMENT, 'Eve'), state()],
    [drive('silent'), null],
    [drive('moved'), state({ moving_job: 'jog-1' })],
    [drive('positions'), state({ modes: [8] })],
    [drive('b'), state()],
  ])
  expect(
    found.map(({ id, missing }) => [
      id,
      typeof missing === 'object' ? (missing?.name ?? null) : missing,
    ]),
  ).toEqual([
    ['b', null],
    ['other', 'segment'],
    ['can', 'segment'],
    ['held', 'control'],
    ['silent', 'answers'],
    ['moved', 'idle'],
    ['positions', 'cyclic'],
  ])
})

test('an axis of no segment has no partner', () => {
  const serial = drive('a', 'modbus://tty0')
  const found = candidatesOf(serial, [[drive('b', 'modbus://tty0'), state()]])
  expect(found.map((each) => each.missing)).toEqual(['segment'])
})

const value = (of: number) => ({ value: of, ci95: [of - 1, of + 1] })
const RESULT = {
  tool: 'gantry',
  partner: 'Right',
  frequency_hz: [4, 8],
  motions: [
    { kind: 'common', magnitude_db: [10, 4], half_db: [1, 2], phase_deg: [-90, -90] },
    { kind: 'skew', magnitude_db: [20, 14], half_db: [0.5, 0.5], phase_deg: [-90, -90] },
  ],
  coupling: [0.9, 0.8],
  coupling_half: [0.1, 0.2],
  modes: [
    {
      kind: 'skew',
      frequency_hz: 38.1,
      frequency_ci95_hz: [38, 38.3],
      damping: 0.062,
      damping_ci95: [0.05, 0.07],
      skew_share: 0.9,
    },
  ],
  inertia_kgm2: null,
  skew_stiffness_nm_per_rad: value(3),
  holding_percent: [value(-28), value(28)],
  friction_percent: [value(2.4), value(2.5)],
  fight_percent: value(-28.6),
  out_of_square_rev: value(-0.019),
  out_of_square_mm: null,
  largest_skew_rev: 0.002,
  margins: null,
  gain_factor: null,
  findings: [
    { code: 'out_of_square', values: { fight: '28.6', way: '0.0191 rev' } },
    { code: 'pair_unstable', values: {} },
    { code: 'skew_mode', values: { frequency: '38.1' } },
  ],
} as unknown as GantryResult

const text = (name: string, values: Record<string, string> = {}) =>
  [name, ...Object.values(values)].filter(Boolean).join(' ')

test('the verdict comes first and has its figures', () => {
  expect(gantryNotes(RESULT, text)).toEqual([
    { words: 'finding.out_of_square 28.6 (0.0191 rev)', tone: 'warn' },
    { words: 'finding.pair_unstable', tone: 'fault' },
    { words: 'finding.skew_mode 38.1', tone: 'info' },
  ])
})

test('each figure has its interval, and a dash where it cannot be known', () => {
  const rows = new Map(gantryRows(RESULT, text).map((row) => [row.name, row]))
  expect(rows.get('fight')).toMatchObject({ value: -28.6, unit: '%', ends: [-29.6, -27.6] })
  expect(rows.get('friction 2')).toMatchObject({ value: 2.5 })
  expect(rows.get('mode.skew 6.2')).toMatchObject({ value: 38.1, ends: [38, 38.3] })
  expect(rows.get('inertia')).toMatchObject({ value: null, ends: null })
  expect(rows.get('ms')).toMatchObject({ value: null })
  expect(rows.has('square_mm')).toBe(false)
})

test('the margins of the pair stand next to those of each axis', () => {
  const margins = {
    stable: true,
    ms: 1.14,
    ms_ci95: [1.1, 1.19],
    ms_hz: 100,
    ms_alone: [1.1, 1.2],
    phase_margin_deg: 60,
    crossover_hz: 40,
  }
  const known = { ...RESULT, margins, gain_factor: 1.5 } as unknown as GantryResult
  const rows = new Map(gantryRows(known, text).map((row) => [row.name, row.value]))
  expect(rows.get('ms')).toBe(1.14)
  expect(rows.get('ms_alone 2')).toBe(1.2)
  expect(rows.get('factor')).toBe(1.5)
})

test('the curves have their bands', () => {
  const [common, skew] = motionCurves(RESULT, text)
  expect(common).toMatchObject({ label: 'motion.common', y: [10, 4], low: [9, 2], high: [11, 6] })
  expect(skew?.label).toBe('motion.skew')
  expect(couplingCurve(RESULT, text).high.map((each) => each.toFixed(1))).toEqual(['1.0', '1.0'])
})
