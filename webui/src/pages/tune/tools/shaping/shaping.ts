import type { ShapingResult } from '../../../../api/schema'
import type { ShownNote, ShownRow, ShownTable, Text } from '../form/shown'
import { engineering } from '../../steps/steps'

const TONES = {
  verified: 'good',
  improved: 'warn',
  no_better: 'warn',
  designed: 'info',
  stated: 'warn',
  not_seen: 'warn',
} as const

/** What somebody should do something about. */
const WARNS: ReadonlySet<string> = new Set([
  'beyond_prediction',
  'not_settled',
  'samples_lost',
  'wide_mode',
])

/** The verdict first, then the findings, as `backend/tools/tuning/shaping/texts.py` has them. */
export function shapingNotes(result: ShapingResult, text: Text): ShownNote[] {
  const found = result.comparison
  const words = text(`verdict.${result.verdict}`, {
    shaper: (result.chosen ?? '').toUpperCase(),
    residual: found ? engineering(100 * found.ratio) : '',
    before: seconds(found?.settling_unshaped_s, found),
    after: seconds(found?.settling_shaped_s, found),
  })
  return [
    { words, tone: TONES[result.verdict] },
    ...(result.findings ?? []).map((each) => ({
      words: text(`finding.${each.code}`, {
        value: each.value == null ? '' : engineering(each.value),
        unit: each.unit ?? '',
        parameter: each.parameter ?? '',
      }),
      tone: WARNS.has(each.code) ? ('warn' as const) : ('info' as const),
    })),
  ]
}

/** A settling time; longer than what was watched, where it did not settle. */
const seconds = (
  value: number | null | undefined,
  found: ShapingResult['comparison'] | undefined,
): string =>
  value == null ? `> ${engineering(found?.watched_s ?? 0)} s` : `${engineering(value)} s`

/** The mode, and what the shaper changed. */
export function shapingRows(result: ShapingResult, text: Text): ShownRow[] {
  const row = (
    name: string,
    value: number | null,
    unit: string,
    ends: ShownRow['ends'] = null,
  ): ShownRow => ({ name: text(name), value, unit, ends })
  const { mode, comparison: found } = result
  return [
    ...(mode
      ? [
          row('frequency', mode.frequency_hz, 'Hz', mode.frequency_ci95_hz),
          row('damping', mode.damping, '', mode.damping_ci95),
          row('ring_downs', mode.ring_downs, ''),
          row('explained', 100 * mode.explained, '%'),
        ]
      : []),
    ...(found
      ? [
          row('unshaped', found.unshaped, found.unit, found.unshaped_ci95),
          row('shaped', found.shaped, found.unit, found.shaped_ci95),
          row('ratio', 100 * found.ratio, '%'),
          row('settling_unshaped', found.settling_unshaped_s, 's'),
          row('settling_shaped', found.settling_shaped_s, 's'),
          row('window', found.settling_window, found.settling_unit),
        ]
      : []),
  ]
}

/**
 * The shapers with their impulses, and what the drive's own filter would take. `ofProfile` says a
 * text of the drive's profile in the language of the page.
 */
export function shapingTables(
  result: ShapingResult,
  text: Text,
  ofProfile: (text: string) => string,
): ShownTable[] {
  const { shapers, drive_values: values } = result
  const list = (numbers: number[], decimals: number) =>
    numbers.map((each) => each.toFixed(decimals)).join(' / ')
  const found: ShownTable[] = []
  if (shapers.length > 0) {
    found.push({
      name: text('head.shaper'),
      head: ['shaper', 'shares', 'times', 'left', 'band'].map((each) => text(`head.${each}`)),
      rows: shapers.map((each) => [
        text(each.kind === result.chosen && result.comparison ? 'chosen' : 'plain', {
          shaper: each.kind.toUpperCase(),
        }),
        list(
          each.impulses.map((one) => 100 * one.share),
          2,
        ),
        list(
          each.impulses.map((one) => 1000 * one.time_s),
          1,
        ),
        each.residual_percent.map((one) => one.toFixed(1)).join('–'),
        each.tolerated_hz.map((one) => engineering(one)).join('–'),
      ]),
    })
  }
  if (values.length > 0) {
    found.push({
      name: text('head.parameter'),
      head: [text('head.parameter'), text('head.value')],
      rows: values.map((each) => [
        text('named', { parameter: each.parameter, name: ofProfile(each.name) }),
        `${engineering(each.value)}\u00a0${each.unit}`.trim(),
      ]),
    })
  }
  return found
}
