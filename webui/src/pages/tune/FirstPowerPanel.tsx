import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asFirstPower } from '../../api/results'
import type { FirstPowerResult, FirstPowerSettings } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob } from '../../live/store'
import { CurvesPlot } from '../../plots/CurvesPlot'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useAction } from '../../widgets/useAction'
import { useToolJob } from '../response/useToolJob'
import { amount } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

/** What a person states about one run; cleared after it. */
const STATED = ['nothing_hangs', 'load_supported'] as const

/** The checklist before the first closed loop. Its limits are its own: 10 % and 0.1 rev at most. */
export function FirstPowerPanel({
  drive,
  obstacle,
  cycleMs,
}: {
  drive: string
  /** What is in the way of a measurement, as text. */
  obstacle: string | null
  cycleMs: number
}) {
  const t = useT()
  const { tool, text } = useTool('first-power')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  const { job, note, dismiss } = useToolJob(drive, 'first-power')
  const begun = job?.id ?? ''
  useEffect(() => setValues(initialValues(fields)), [fields, drive])
  // Stated for one run, never for the next.
  useEffect(
    () => setValues((old) => ({ ...old, ...Object.fromEntries(STATED.map((n) => [n, false])) })),
    [begun],
  )
  const start = useAction()
  const result = asFirstPower(job?.result)
  if (!tool) return null
  const stated = STATED.some((name) => values[name] === true) || values.powered !== true
  const go = () =>
    start.run(async () => {
      const body = { cycle_ms: cycleMs, ...values } as FirstPowerSettings
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/first-power', {
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
      <ToolForm
        tool={tool}
        limits={null}
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
      {result && <FirstPowerAnswer result={result} text={text} />}
    </Panel>
  )
}

const COLORS = { light: ['#1a5c94', '#c2571a'], dark: ['#6db3f2', '#f0a060'] } as const
const TONES = { passed: 'good', failed: 'warn', open: 'info' } as const

/** Verdict, one line for each check, and where the pulses turned the shaft. */
export function FirstPowerAnswer({ result, text }: { result: FirstPowerResult; text: Text }) {
  const dark = useComputedColorScheme('light') === 'dark'
  const [first, second] = COLORS[dark ? 'dark' : 'light']
  const curves = useMemo(() => {
    const numbered = result.pulses.map((pulse, at) => ({ ...pulse, number: at + 1 }))
    return ([1, -1] as const).map((way) => {
      const ours = numbered.filter((each) => each.direction === way)
      return {
        label: text(way > 0 ? 'forward' : 'backward'),
        color: way > 0 ? first : second,
        x: ours.map((each) => each.number),
        y: ours.map((each) => each.to_rev),
      }
    })
  }, [result, text, first, second])
  const at = result.measured_at.slice(0, 19).replace('T', ' ')
  return (
    <>
      <p className={`note ${result.verdict === 'passed' ? 'good' : 'warn'}`}>
        {text(`verdict.${result.verdict}`)}
      </p>
      <ul className="plain" aria-label={text('check')}>
        {result.checks.map((each) => (
          <li key={each.name} className={`note ${TONES[each.status]}`}>
            {text(`${each.name}.${each.finding}`, { value: figure(each.value) })}
          </li>
        ))}
      </ul>
      {result.covers_pole_pairs != null && (
        <p className="dim">{text('covers', { value: String(result.covers_pole_pairs) })}</p>
      )}
      {result.guide && <p className="note info">{text(`guide.${result.guide}`)}</p>}
      {result.pulses.length > 0 && (
        <>
          <CurvesPlot
            curves={curves}
            xLabel={text('chart_number')}
            yLabel={text('chart_place')}
            label={text('chart')}
            dark={dark}
          />
          <p className="dim">
            {text('travel')}: {amount(result.travel_rev, 'rev')}; {text('torque')}:{' '}
            {amount(result.torque_percent, '%')}
          </p>
        </>
      )}
      <p className="dim">{text('measured_at', { at })}</p>
    </>
  )
}

/** Whole numbers in full, others to four digits; as the report has them. */
export function figure(value: number | null | undefined): string {
  if (value == null) return ''
  return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(4)))
}
