import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asBrakeTest } from '../../api/results'
import type { BrakeResult, BrakeSettings } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob } from '../../live/store'
import { CurvesPlot } from '../../plots/CurvesPlot'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useAction } from '../../widgets/useAction'
import type { Limits } from '../response/limits'
import { useToolJob } from '../response/useToolJob'
import { amount, engineering } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

/** What a person states about one test; undone after it. */
const STATED = ['brake_supply_cut', 'nothing_hangs', 'load_supported'] as const
/** Below this share of its limit slip is what an encoder and a settling hub show. */
const CREPT = 0.05
const SHORT = 0.95

/** Torque against the closed brake: dangers first, then what hangs, then the start. */
export function BrakePanel({
  drive,
  limits,
  obstacle,
  cycleMs,
}: {
  drive: string
  limits: Limits | null
  /** What is in the way of a measurement, as text. */
  obstacle: string | null
  cycleMs: number
}) {
  const t = useT()
  const { tool, text } = useTool('brake-test')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  const { job, note, dismiss } = useToolJob(drive, 'brake-test')
  const begun = job?.id ?? ''
  useEffect(() => setValues(initialValues(fields)), [fields, drive])
  // Stated for one test, never for the next.
  useEffect(
    () => setValues((old) => ({ ...old, ...Object.fromEntries(STATED.map((n) => [n, false])) })),
    [begun],
  )
  const start = useAction()
  const result = asBrakeTest(job?.result)
  if (!tool) return null
  const stated = values.nothing_hangs === true || values.load_supported === true
  const go = () =>
    start.run(async () => {
      if (!limits) return
      const body = { ...limits, cycle_ms: cycleMs, ...values } as BrakeSettings
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/brake-test', {
            params: { path: { drive_id: drive } },
            body,
          }),
        ),
      )
    })
  const missing = complete(fields, values)
    ? stated
      ? null
      : text('state_first')
    : t('start.incomplete')
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      <p className="note warn">{text('danger')}</p>
      <p className="note warn">{text('warning')}</p>
      <p>{text('step.support')}</p>
      <p>{text('step.clear')}</p>
      <p>{text('step.state')}</p>
      <ToolForm
        tool={tool}
        limits={limits}
        fields={fields}
        values={values}
        text={text}
        onChange={setValues}
      />
      <StartButton obstacle={obstacle ?? missing} busy={start.busy} onStart={() => void go()}>
        {text('start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {result && <BrakeAnswer result={result} text={text} />}
    </Panel>
  )
}

const COLORS = { light: ['#1a5c94', '#c2571a'], dark: ['#6db3f2', '#f0a060'] } as const

/** Verdict, both directions side by side, and travel over torque. */
export function BrakeAnswer({ result, text }: { result: BrakeResult; text: Text }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const [first, second] = COLORS[dark ? 'dark' : 'light']
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
      {notesOf(result, text).map((each) => (
        <p key={each.words} className={`note ${each.tone}`}>
          {each.words}
        </p>
      ))}
      {curves.some((each) => each.x.length > 0) && (
        <CurvesPlot
          curves={curves}
          xLabel={text('chart_torque')}
          yLabel={text('chart_travel')}
          label={text('chart')}
          dark={dark}
        />
      )}
      {result.ways.length > 0 && (
        <div className="scroll-table">
          <table className="reported-values" aria-label={text('title')}>
            <thead>
              <tr>
                <th>{t('inertia.quantity')}</th>
                <th className="right">{t('inertia.value')}</th>
              </tr>
            </thead>
            <tbody className="num">
              {rowsOf(result, text).map((row) => (
                <tr key={row.name}>
                  <td>{row.name}</td>
                  <td className="right">{amount(row.value, row.unit)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </>
  )
}

interface ShownNote {
  words: string
  tone: 'good' | 'warn' | 'info'
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

interface ShownRow {
  name: string
  value: number
  unit: string
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
