import { Button, NativeSelect, TextInput } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../../../api/client'
import { resultOf } from '../../../../api/results'
import type { SafetyResult } from '../../../../api/schema'
import { useT } from '../../../../i18n'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { ProblemNote } from '../../../../widgets/messages/ProblemNote'
import { useAction } from '../../../../widgets/requests/useAction'
import { Notes, useCurveColors, ValuesTable } from '../form/Answer'
import { notesOf, rowsOf } from './safety'
import type { Text } from '../form/shown'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../form/ToolPanel'

const FUNCTIONS = ['sto', 'ss1', 'limit_positive', 'limit_negative', 'speed_limit'] as const
/** What a person states about one check; asked again for the next. */
const STATED = ['nothing_hangs', 'load_supported'] as const

/** A safety function that a person triggers by hand, recorded and signed; it certifies nothing. */
export function SafetyPanel(measured: Measured) {
  const run = useToolRun('safety-check', measured.drive, { stated: STATED })
  const { text, values, job } = run
  const [which, setWhich] = useState<(typeof FUNCTIONS)[number]>('sto')
  const [device, setDevice] = useState('')
  const [person, setPerson] = useState(() => localStorage.getItem('servodeck.report.person') ?? '')
  const [signed, setSigned] = useState<SafetyResult | null>(null)
  useEffect(() => setSigned(null), [job?.id])
  const result = signed ?? resultOf('safety-check', job?.result)
  const stated = values.nothing_hangs === true || values.load_supported === true
  return (
    <ToolPanel
      run={run}
      answer={
        result && (
          <>
            <SafetyAnswer result={result} text={text} />
            {!result.signature && <Sign result={result} text={text} onSigned={setSigned} />}
          </>
        )
      }
    >
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
      <MeasuredStart
        run={run}
        measured={measured}
        asked={{ function: which, device, person }}
        missing={!device.trim() ? text('name_first') : stated ? null : text('state_first')}
      />
    </ToolPanel>
  )
}

/** Verdict, values, and speed and torque from the first sign on. */
function SafetyAnswer({ result, text }: { result: SafetyResult; text: Text }) {
  const t = useT()
  const [first, second] = useCurveColors()
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
      <Notes notes={notesOf(result, text)} />
      {x.length > 0 && (
        <>
          <CurvesPlot
            curves={curves}
            xLabel={text('chart_ms')}
            yLabel={text('chart_rpm')}
            label={text('chart')}
          />
          <CurvesPlot
            curves={torque}
            xLabel={text('chart_ms')}
            yLabel={text('chart_percent')}
            label={text('chart_torque')}
          />
        </>
      )}
      <ValuesTable
        rows={rowsOf(result, text)}
        label={text('title')}
        unknown={t('safety.notShown')}
      />
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
      const made = resultOf('safety-check', await ask(answer))
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
