import { useMemo } from 'react'
import { resultOf } from '../../../api/results'
import type { BrakeResult } from '../../../api/schema'
import { CurvesPlot } from '../../../plots/CurvesPlot'
import { Notes, useCurveColors, ValuesTable } from './form/Answer'
import type { ShownNote, ShownRow, Text } from './form/shown'
import { engineering } from '../steps/steps'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from './form/ToolPanel'

/** What a person states about one test; cleared after it. */
const STATED = ['brake_supply_cut', 'nothing_hangs', 'load_supported'] as const
/** Below this share of its limit slip is what an encoder and a settling hub show. */
const CREPT = 0.05
const SHORT = 0.95

/** Torque against the closed brake: dangers first, then what hangs, then the start. */
export function BrakePanel(measured: Measured) {
  const run = useToolRun('brake-test', measured.drive, { stated: STATED })
  const { text, values } = run
  const result = resultOf('brake-test', run.job?.result)
  const stated = values.nothing_hangs === true || values.load_supported === true
  return (
    <ToolPanel run={run} answer={result && <BrakeAnswer result={result} text={text} />}>
      <p className="note warn">{text('danger')}</p>
      <p className="note warn">{text('warning')}</p>
      <p>{text('step.support')}</p>
      <p>{text('step.clear')}</p>
      <p>{text('step.state')}</p>
      <MeasuredStart run={run} measured={measured} missing={stated ? null : text('state_first')} />
    </ToolPanel>
  )
}

/** Verdict, both directions side by side, and travel over torque. */
function BrakeAnswer({ result, text }: { result: BrakeResult; text: Text }) {
  const [first, second] = useCurveColors()
  const curves = useMemo(
    () =>
      result.ways.map((way) => ({
        label: text(way.direction > 0 ? 'forward' : 'backward'),
        color: way.direction > 0 ? first : second,
        x: way.curve_torque_percent,
        y: way.curve_travel_rev,
      })),
    [result, text, first, second],
  )
  return (
    <>
      <Notes notes={notesOf(result, text)} />
      {curves.some((each) => each.x.length > 0) && (
        <CurvesPlot
          curves={curves}
          xLabel={text('chart_torque')}
          yLabel={text('chart_travel')}
          label={text('chart')}
        />
      )}
      {result.ways.length > 0 && <ValuesTable rows={rowsOf(result, text)} label={text('title')} />}
    </>
  )
}

/** The verdict first, then why, how the brake was kept closed, and when. */
export function notesOf(result: BrakeResult, text: Text): ShownNote[] {
  const { verdict, obstacle, means, torque_percent: carried } = result
  const most = Math.max(...result.ways.map((way) => way.torque_ci95_percent[1]))
  const value = verdict === 'not_closed' ? most : carried
  const shown = value == null ? '' : engineering(value)
  const tone = verdict === 'held' ? 'good' : 'warn'
  const found: ShownNote[] = [{ words: text(`verdict.${verdict}`, { value: shown }), tone }]
  if (obstacle) found.push({ words: text(`obstacle.${obstacle}`), tone: 'warn' })
  for (const way of result.ways) {
    if (way.verdict === 'held' && way.slip_rev > CREPT * result.slip_limit_rev) {
      found.push({ words: text('crept', { value: engineering(way.slip_rev) }), tone: 'warn' })
    }
  }
  const reached = ['held', 'cannot_be_tested'].includes(verdict) && !obstacle
  if (reached && carried != null && carried < SHORT * result.test_percent) {
    found.push({ words: text('torque_short', { value: shown }), tone: 'warn' })
  }
  if (means) found.push({ words: text(`by.${means}`), tone: 'info' })
  const at = result.measured_at.slice(0, 19).replace('T', ' ')
  found.push({ words: text('measured_at', { at }), tone: 'info' })
  return found
}

/** In Nm where the rated torque is known, else in % of it. */
export function rowsOf(result: BrakeResult, text: Text): ShownRow[] {
  const rated = result.rated_torque_nm
  const [torque, unit] = rated === null ? [1, '%'] : [rated / 100, 'N·m']
  const rows = [{ name: text('test_torque'), value: torque * result.test_percent, unit }]
  for (const way of result.ways) {
    const side = way.direction > 0 ? 'forward' : 'backward'
    rows.push(
      { name: text(`torque.${side}`), value: torque * way.torque_percent, unit },
      { name: text(`travel.${side}`), value: way.travel_rev, unit: 'rev' },
      { name: text(`windup.${side}`), value: way.windup_rev, unit: 'rev' },
      { name: text(`slip.${side}`), value: way.slip_rev, unit: 'rev' },
    )
    if (way.abort_ms != null) {
      rows.push({ name: text(`abort.${side}`), value: way.abort_ms, unit: 'ms' })
    }
  }
  if (result.of_brake_percent != null) {
    rows.push({ name: text('of_brake'), value: result.of_brake_percent, unit: '%' })
  }
  return rows
}
