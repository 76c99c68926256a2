import { NativeSelect, useComputedColorScheme } from '@mantine/core'
import { type ReactNode, useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asDwell, asVibration } from '../../api/results'
import type {
  DwellResult,
  DwellSettings,
  VibrationResult,
  VibrationSettings,
} from '../../api/schema'
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
import { amount, interval } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'
import { dwellRows, levelCurves, vibrationNotes, vibrationRows, vibrationTables } from './vibration'

type Text = (name: string, values?: Record<string, string>) => string

interface Measured {
  drive: string
  limits: Limits | null
  /** What is in the way of a measurement, in words. */
  obstacle: string | null
  cycleMs: number
}

/** Orders, frequencies and resonances over the speed. */
export function VibrationPanel(measured: Measured) {
  const { drive } = measured
  const { job } = useToolJob(drive, 'vibration')
  const result = asVibration(job?.result)
  return (
    <VibrationTool
      {...measured}
      kind="vibration"
      start={(body) =>
        ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/vibration', {
            params: { path: { drive_id: drive } },
            body: body as VibrationSettings,
          }),
        )
      }
      answer={(text) => result && <VibrationAnswer result={result} text={text} />}
    />
  )
}

const CARRIERS = ['speed', 'torque'] as const

/** A vibration at one frequency, to find what rattles by hand and ear. */
export function DwellPanel(measured: Measured) {
  const { drive } = measured
  const [by, setBy] = useState<(typeof CARRIERS)[number]>('speed')
  const { job } = useToolJob(drive, 'dwell')
  const result = asDwell(job?.result)
  return (
    <VibrationTool
      {...measured}
      kind="dwell"
      before={(text) => (
        <div className="fields wide">
          <NativeSelect
            label={text('field.by')}
            value={by}
            onChange={(event) => setBy(event.currentTarget.value as typeof by)}
            data={CARRIERS.map((each) => ({ value: each, label: text(`by.${each}`) }))}
          />
        </div>
      )}
      start={(body) =>
        ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/dwell', {
            params: { path: { drive_id: drive } },
            body: { ...body, by } as DwellSettings,
          }),
        )
      }
      answer={(text) => result && <DwellAnswer result={result} text={text} />}
    />
  )
}

/** The form of one of both, its job and its answer. */
function VibrationTool({
  kind,
  drive,
  limits,
  obstacle,
  cycleMs,
  before,
  start: begin,
  answer,
}: Measured & {
  kind: 'vibration' | 'dwell'
  before?: (text: Text) => ReactNode
  start: (body: object) => Promise<Parameters<typeof setJob>[0]>
  answer: (text: Text) => ReactNode
}) {
  const t = useT()
  const { tool, text } = useTool(kind)
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  useEffect(() => setValues(initialValues(fields)), [fields])
  const { note, dismiss } = useToolJob(drive, kind)
  const start = useAction()
  if (!tool) return null
  const go = () =>
    start.run(async () => {
      if (limits) setJob(await begin({ ...limits, cycle_ms: cycleMs, ...values }))
    })
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      {before?.(text)}
      <ToolForm
        tool={tool}
        limits={limits}
        fields={fields}
        values={values}
        text={text}
        onChange={setValues}
      />
      <StartButton
        obstacle={obstacle ?? (complete(fields, values) ? null : t('start.incomplete'))}
        busy={start.busy}
        onStart={() => void go()}
      >
        {text('start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {answer(text)}
    </Panel>
  )
}

const COLORS = {
  light: ['#1a5c94', '#c2571a', '#2e7d32', '#7b3fa0'],
  dark: ['#6db3f2', '#f0a060', '#7fd08a', '#c79bea'],
} as const

function VibrationAnswer({ result, text }: { result: VibrationResult; text: Text }) {
  const dark = useComputedColorScheme('light') === 'dark'
  const curves = useMemo(
    () =>
      levelCurves(result).map((each, at) => ({
        ...each,
        color: COLORS[dark ? 'dark' : 'light'][at] ?? 'gray',
      })),
    [result, dark],
  )
  return (
    <>
      <Notes findings={result.findings} text={text} />
      {curves.length > 0 && (
        <CurvesPlot
          curves={curves}
          xLabel={text('axis.speed')}
          yLabel={text('axis.level')}
          label={text('over_speed')}
          dark={dark}
        />
      )}
      <Rows rows={vibrationRows(result, text)} label={text('title')} />
      {vibrationTables(result, text).map((table) => (
        <div className="scroll-table" key={table.name}>
          <table className="reported-values" aria-label={table.name}>
            <thead>
              <tr>
                {table.head.map((each) => (
                  <th key={each}>{each}</th>
                ))}
              </tr>
            </thead>
            <tbody className="num">
              {table.rows.map((row) => (
                <tr key={row.slice(0, 2).join()}>
                  {row.map((cell, place) => (
                    <td key={table.head[place]}>{cell}</td>
                  ))}
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      ))}
    </>
  )
}

function DwellAnswer({ result, text }: { result: DwellResult; text: Text }) {
  const dark = useComputedColorScheme('light') === 'dark'
  const color = COLORS[dark ? 'dark' : 'light'][0]
  const curves = useMemo(
    () => [{ label: text('line'), color, x: result.trace_s, y: result.trace_rpm }],
    [result, text, color],
  )
  return (
    <>
      <Notes findings={result.findings} text={text} />
      <CurvesPlot
        curves={curves}
        xLabel={text('axis.time')}
        yLabel={text('axis.speed')}
        label={text('over_time')}
        dark={dark}
      />
      <Rows rows={dwellRows(result, text)} label={text('title')} />
    </>
  )
}

function Notes({
  findings,
  text,
}: {
  findings: VibrationResult['findings'] | DwellResult['findings']
  text: Text
}) {
  return vibrationNotes(findings, text).map((each) => (
    <p key={each.words} className={`note ${each.tone}`}>
      {each.words}
    </p>
  ))
}

function Rows({ rows, label }: { rows: ReturnType<typeof dwellRows>; label: string }) {
  const t = useT()
  if (rows.length === 0) return null
  return (
    <div className="scroll-table">
      <table className="reported-values" aria-label={label}>
        <thead>
          <tr>
            <th>{t('inertia.quantity')}</th>
            <th className="right">{t('inertia.value')}</th>
          </tr>
        </thead>
        <tbody className="num">
          {rows.map((row) => (
            <tr key={`${row.name} ${row.value}`}>
              <td>{row.name}</td>
              <td className="right">
                {amount(row.value, row.value === null ? '' : row.unit)}
                <small className="dim interval">{interval(row.ends)}</small>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}
