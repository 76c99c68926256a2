import { Button } from '@mantine/core'
import { useMemo } from 'react'
import { resultOf } from '../../../../api/results'
import type { FrictionResult } from '../../../../api/schema'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { Icon } from '../../../../widgets/layout/Icon'
import { offerDownload } from '../../../../widgets/browser/download'
import { useCurveColors, ValuesTable } from '../form/Answer'
import { compensationCsv } from './friction'
import type { Ends, ShownRow, Text } from '../form/shown'
import { engineering } from '../../steps/steps'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../form/ToolPanel'

/** Torque over speed and over position; form and texts are the tool's own, from the server. */
export function FrictionPanel(measured: Measured) {
  const run = useToolRun('friction', measured.drive)
  const result = resultOf('friction', run.job?.result)
  return (
    <ToolPanel run={run} answer={result && <FrictionMap result={result} text={run.text} />}>
      <MeasuredStart run={run} measured={measured} />
    </ToolPanel>
  )
}

const RPM_PER_RAD_S = 60 / (2 * Math.PI)

/** Findings, curves, parameters with their intervals, and the ripple's harmonics. */
function FrictionMap({ result, text }: { result: FrictionResult; text: Text }) {
  const [first, second] = useCurveColors()
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
      />
      {result.ripple_angle_deg.length > 0 && (
        <CurvesPlot
          curves={overAngle}
          xLabel={text('angle')}
          yLabel={text('torque')}
          label={text('over_angle')}
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
      <ValuesTable rows={rowsOf(result, text)} label={text('title')} />
    </>
  )
}

/** In Nm where the rated torque is known, else in % of it; a dash is what cannot be known. */
export function rowsOf(result: FrictionResult, text: Text): ShownRow[] {
  const rated = result.rated_torque_nm
  const [torque, unit] = rated === null ? [1, '%'] : [rated / 100, 'N·m']
  const [slope, slopeUnit] =
    rated === null ? [1, '%/rpm'] : [(rated / 100) * RPM_PER_RAD_S, 'N·m·s/rad']
  const row = (
    name: string,
    found: { value: number; ci95: NonNullable<Ends> } | null | undefined,
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

const scaled = ([low, high]: NonNullable<Ends>, factor: number): Ends => [
  low === null ? null : factor * low,
  high === null ? null : factor * high,
]
