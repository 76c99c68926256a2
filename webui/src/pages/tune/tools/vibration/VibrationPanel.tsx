import { NativeSelect } from '@mantine/core'
import { useMemo, useState } from 'react'
import { resultOf } from '../../../../api/results'
import type { DwellResult, VibrationResult } from '../../../../api/schema'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { ListTables, Notes, useCurveColors, ValuesTable } from '../form/Answer'
import type { Text } from '../form/shown'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../form/ToolPanel'
import { dwellRows, levelCurves, vibrationNotes, vibrationRows, vibrationTables } from './vibration'

/** Orders, frequencies and resonances over the speed. */
export function VibrationPanel(measured: Measured) {
  const run = useToolRun('vibration', measured.drive)
  const result = resultOf('vibration', run.job?.result)
  return (
    <ToolPanel run={run} answer={result && <VibrationAnswer result={result} text={run.text} />}>
      <MeasuredStart run={run} measured={measured} />
    </ToolPanel>
  )
}

const CARRIERS = ['speed', 'torque'] as const

/** A vibration at one frequency, to find what rattles by hand and ear. */
export function DwellPanel(measured: Measured) {
  const run = useToolRun('dwell', measured.drive)
  const { text } = run
  const [by, setBy] = useState<(typeof CARRIERS)[number]>('speed')
  const result = resultOf('dwell', run.job?.result)
  return (
    <ToolPanel run={run} answer={result && <DwellAnswer result={result} text={text} />}>
      <div className="fields wide">
        <NativeSelect
          label={text('field.by')}
          value={by}
          onChange={(event) => setBy(event.currentTarget.value as typeof by)}
          data={CARRIERS.map((each) => ({ value: each, label: text(`by.${each}`) }))}
        />
      </div>
      <MeasuredStart run={run} measured={measured} asked={{ by }} />
    </ToolPanel>
  )
}

function VibrationAnswer({ result, text }: { result: VibrationResult; text: Text }) {
  const colors = useCurveColors()
  const curves = useMemo(
    () => levelCurves(result).map((each, at) => ({ ...each, color: colors[at] ?? 'gray' })),
    [result, colors],
  )
  return (
    <>
      <Notes notes={vibrationNotes(result.findings, text)} />
      {curves.length > 0 && (
        <CurvesPlot
          curves={curves}
          xLabel={text('axis.speed')}
          yLabel={text('axis.level')}
          label={text('over_speed')}
        />
      )}
      <ValuesTable rows={vibrationRows(result, text)} label={text('title')} />
      <ListTables tables={vibrationTables(result, text)} />
    </>
  )
}

function DwellAnswer({ result, text }: { result: DwellResult; text: Text }) {
  const [color] = useCurveColors()
  const curves = useMemo(
    () => [{ label: text('line'), color, x: result.trace_s, y: result.trace_rpm }],
    [result, text, color],
  )
  return (
    <>
      <Notes notes={vibrationNotes(result.findings, text)} />
      <CurvesPlot
        curves={curves}
        xLabel={text('axis.time')}
        yLabel={text('axis.speed')}
        label={text('over_time')}
      />
      <ValuesTable rows={dwellRows(result, text)} label={text('title')} />
    </>
  )
}
