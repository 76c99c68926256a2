import { Button, useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asFriction } from '../../api/results'
import type { FrictionResult, FrictionSettings } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob } from '../../live/store'
import { CurvesPlot } from '../../plots/CurvesPlot'
import { Icon } from '../../widgets/Icon'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useAction } from '../../widgets/useAction'
import { offerDownload } from '../files/sets'
import type { Limits } from '../response/limits'
import { useToolJob } from '../response/useToolJob'
import { compensationCsv } from './friction'
import { amount, engineering, interval } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

/** Torque over speed and over position; form and words are the tool's own, from the server. */
export function FrictionPanel({
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
  const { tool, text } = useTool('friction')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  useEffect(() => setValues(initialValues(fields)), [fields])
  const { job, note, dismiss } = useToolJob(drive, 'friction')
  const start = useAction()
  const result = asFriction(job?.result)
  if (!tool) return null
  const go = () =>
    start.run(async () => {
      if (!limits) return
      const body = { ...limits, cycle_ms: cycleMs, ...values } as FrictionSettings
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/friction', {
            params: { path: { drive_id: drive } },
            body,
          }),
        ),
      )
    })
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
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
      {result && <FrictionMap result={result} text={text} />}
    </Panel>
  )
}

const COLORS = { light: ['#1a5c94', '#c2571a'], dark: ['#6db3f2', '#f0a060'] } as const
const RPM_PER_RAD_S = 60 / (2 * Math.PI)

/** Findings, curves, parameters with their intervals, and the ripple's harmonics. */
export function FrictionMap({ result, text }: { result: FrictionResult; text: Text }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const [first, second] = COLORS[dark ? 'dark' : 'light']
  const overSpeed = useMemo(() => {
    const { points } = result
    return [
      { label: text('curve'), color: first, x: result.curve_speed_rpm, y: result.curve_percent },
      {
        label: text('points'),
        color: second,
        points: true,
        x: points.map((each) => each.speed_rpm),
        y: points.map((each) => each.torque_percent),
        low: points.map((each) => each.torque_ci95_percent[0]),
        high: points.map((each) => each.torque_ci95_percent[1]),
      },
    ]
  }, [result, first, second])
  const overAngle = useMemo(() => {
    const x = result.ripple_angle_deg
    return [
      { label: text('forward'), color: first, x, y: result.ripple_forward_percent },
      { label: text('backward'), color: second, x, y: result.ripple_backward_percent },
    ]
  }, [result, first, second])
  return (
    <>
      {result.findings.map((each) => (
        <p key={each.code} className={`note ${each.code === 'mapped' ? 'good' : 'info'}`}>
          {text(`finding.${each.code}`, {
            value: each.value == null ? '' : engineering(each.value),
            unit: each.unit ?? '',
          })}
        </p>
      ))}
      <CurvesPlot
        curves={overSpeed}
        xLabel={text('speed')}
        yLabel={text('torque')}
        label={text('over_speed')}
        dark={dark}
      />
      {result.ripple_angle_deg.length > 0 && (
        <CurvesPlot
          curves={overAngle}
          xLabel={text('angle')}
          yLabel={text('torque')}
          label={text('over_angle')}
          dark={dark}
        />
      )}
      {result.compensation_percent.length > 0 && (
        <Button
          leftSection={<Icon name="download" size={14} />}
          onClick={() => offerDownload('compensation.csv', [compensationCsv(result)], 'text/csv')}
        >
          {text('save_table')}
        </Button>
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
                  {amount(row.value, row.value === null ? '' : row.unit)}
                  <small className="dim interval">{interval(row.ends)}</small>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  )
}

interface ShownRow {
  name: string
  value: number | null
  ends: [number | null, number | null] | null
  unit: string
}

/** In Nm where the rated torque is known, else in % of it; a dash is what cannot be known. */
export function rowsOf(result: FrictionResult, text: Text): ShownRow[] {
  const rated = result.rated_torque_nm
  const [torque, unit] = rated === null ? [1, '%'] : [rated / 100, 'N·m']
  const [slope, slopeUnit] =
    rated === null ? [1, '%/rpm'] : [(rated / 100) * RPM_PER_RAD_S, 'N·m·s/rad']
  const row = (
    name: string,
    found: { value: number; ci95: [number | null, number | null] } | null | undefined,
    factor: number,
    shown: string,
  ): ShownRow => ({
    name,
    value: found ? factor * found.value : null,
    ends: found ? scaled(found.ci95, factor) : null,
    unit: shown,
  })
  return [
    row(text('coulomb'), result.coulomb_percent, torque, unit),
    row(text('viscous'), result.viscous_percent_per_rpm, slope, slopeUnit),
    row(text('stribeck'), result.stribeck_percent, torque, unit),
    row(text('stribeck_speed'), result.stribeck_speed_rpm, 1, 'rpm'),
    row(text('load'), result.load_percent, torque, unit),
    row(text('standstill'), result.standstill_percent, torque, unit),
    ...result.harmonics.map((each) =>
      row(
        text('harmonic', { order: String(each.order_per_rev) }),
        { value: each.amplitude_percent, ci95: each.amplitude_ci95_percent },
        torque,
        unit,
      ),
    ),
  ]
}

const scaled = (
  ends: [number | null, number | null],
  factor: number,
): [number | null, number | null] => [
  ends[0] === null ? null : factor * ends[0],
  ends[1] === null ? null : factor * ends[1],
]
