import { Button, NativeSelect, TextInput, useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asSafetyCheck } from '../../api/results'
import type { SafetyResult, SafetySettings } from '../../api/schema'
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
import { notesOf, rowsOf } from './safety'
import { amount } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

const FUNCTIONS = ['sto', 'ss1', 'limit_positive', 'limit_negative', 'speed_limit'] as const
/** What a person states about one check; asked again for the next. */
const STATED = ['nothing_hangs', 'load_supported'] as const

/** A safety function that a person triggers by hand, recorded and signed; it certifies nothing. */
export function SafetyPanel({
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
  const { tool, text } = useTool('safety-check')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  const [which, setWhich] = useState<(typeof FUNCTIONS)[number]>('sto')
  const [device, setDevice] = useState('')
  const [person, setPerson] = useState(() => localStorage.getItem('servodeck.report.person') ?? '')
  const [signed, setSigned] = useState<SafetyResult | null>(null)
  const { job, note, dismiss } = useToolJob(drive, 'safety-check')
  const begun = job?.id ?? ''
  useEffect(() => setValues(initialValues(fields)), [fields, drive])
  useEffect(() => {
    setValues((old) => ({ ...old, ...Object.fromEntries(STATED.map((n) => [n, false])) }))
    setSigned(null)
  }, [begun])
  const start = useAction()
  const result = signed ?? asSafetyCheck(job?.result)
  if (!tool) return null
  const stated = values.nothing_hangs === true || values.load_supported === true
  const go = () =>
    start.run(async () => {
      if (!limits) return
      const own = { function: which, device, person }
      const body = { ...limits, cycle_ms: cycleMs, ...values, ...own } as SafetySettings
      const params = { path: { drive_id: drive } }
      setJob(await ask(api.POST('/api/v1/drives/{drive_id}/jobs/safety-check', { params, body })))
    })
  const missing = !complete(fields, values)
    ? t('start.incomplete')
    : !device.trim()
      ? text('name_first')
      : stated
        ? null
        : text('state_first')
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      <p className="note warn">{text('no_certificate')}</p>
      <p className="note warn">{text('danger')}</p>
      <p className="note warn">{text('warning')}</p>
      <div className="fields wide">
        <NativeSelect
          label={text('field.function')}
          value={which}
          onChange={(event) => setWhich(event.currentTarget.value as typeof which)}
          data={FUNCTIONS.map((each) => ({ value: each, label: text(`function.${each}`) }))}
        />
        <TextInput
          label={text('field.device')}
          value={device}
          maxLength={100}
          onChange={(event) => setDevice(event.currentTarget.value)}
        />
        <TextInput
          label={text('field.person')}
          value={person}
          maxLength={100}
          onChange={(event) => setPerson(event.currentTarget.value)}
        />
      </div>
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
      {result && <SafetyAnswer result={result} text={text} />}
      {result && !result.signature && <Sign result={result} text={text} onSigned={setSigned} />}
    </Panel>
  )
}

/** Verdict, values, and speed and torque from the first sign on. */
function SafetyAnswer({ result, text }: { result: SafetyResult; text: Text }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const [first, second] = dark ? ['#6db3f2', '#f0a060'] : ['#1a5c94', '#c2571a']
  const x = result.trace_ms ?? []
  const curves = useMemo(
    () => [
      { label: text('line_speed'), color: first, x, y: result.trace_rpm ?? [] },
      { label: text('line_commanded'), color: second, x, y: result.trace_commanded_rpm ?? [] },
    ],
    [result, text, first, second],
  )
  const torque = useMemo(
    () => [{ label: text('line_torque'), color: first, x, y: result.trace_torque_percent ?? [] }],
    [result, text, first],
  )
  return (
    <>
      {notesOf(result, text).map((each) => (
        <p key={each.words} className={`note ${each.tone}`}>
          {each.words}
        </p>
      ))}
      {x.length > 0 && (
        <>
          <CurvesPlot
            curves={curves}
            xLabel={text('chart_ms')}
            yLabel={text('chart_rpm')}
            label={text('chart')}
            dark={dark}
          />
          <CurvesPlot
            curves={torque}
            xLabel={text('chart_ms')}
            yLabel={text('chart_percent')}
            label={text('chart_torque')}
            dark={dark}
          />
        </>
      )}
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
                <td className="right">
                  {row.value === null ? t('safety.notShown') : amount(row.value, row.unit)}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  )
}

function Sign({
  result,
  text,
  onSigned,
}: {
  result: SafetyResult
  text: Text
  onSigned: (signed: SafetyResult) => void
}) {
  const sign = useAction()
  const [person, setPerson] = useState(result.person)
  const [notes, setNotes] = useState('')
  const name = result.measurements?.at(-1)
  if (!name) return null
  const go = () =>
    sign.run(async () => {
      const params = { path: { name } }
      const body = { person, notes }
      const answer = api.POST('/api/v1/measurements/{name}/signature', { params, body })
      const made = asSafetyCheck(await ask(answer))
      if (made) onSigned(made)
    })
  return (
    <>
      <div className="fields wide">
        <TextInput
          label={text('signature.person')}
          value={person}
          maxLength={200}
          onChange={(event) => setPerson(event.currentTarget.value)}
        />
        <TextInput
          label={text('signature.notes')}
          value={notes}
          maxLength={4000}
          onChange={(event) => setNotes(event.currentTarget.value)}
        />
      </div>
      <div className="row wrap">
        <Button loading={sign.busy} onClick={() => void go()}>
          {text('signature.do')}
        </Button>
      </div>
      <ProblemNote problem={sign.problem} onClose={sign.clear} />
    </>
  )
}
