import { useMemo } from 'react'
import { resultOf } from '../../../../api/results'
import type { LoadSideResult } from '../../../../api/schema'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { Notes, useCurveColors, ValuesTable } from '../form/Answer'
import { loadSideNotes, loadSideRows } from './loadSide'
import type { Text } from '../form/shown'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../form/ToolPanel'

/** Backlash, stiffness and transmission error, where the drive reports a second position. */
export function LoadSidePanel(measured: Measured) {
  const run = useToolRun('load-side', measured.drive)
  const result = resultOf('load-side', run.job?.result)
  return (
    <ToolPanel run={run} answer={result && <LoadSideAnswer result={result} text={run.text} />}>
      <MeasuredStart run={run} measured={measured} />
    </ToolPanel>
  )
}

/** Verdict and findings, the error over the load's angle, and the figures with their intervals. */
function LoadSideAnswer({ result, text }: { result: LoadSideResult; text: Text }) {
  const [color] = useCurveColors()
  const curves = useMemo(
    () => [{ label: text('curve'), color, x: result.error_angle_deg, y: result.error_deg }],
    [result, color],
  )
  return (
    <>
      <Notes notes={loadSideNotes(result, text)} />
      <CurvesPlot
        curves={curves}
        xLabel={text('angle')}
        yLabel={text('error')}
        label={text('over_angle')}
      />
      <ValuesTable rows={loadSideRows(result, text)} label={text('title')} />
    </>
  )
}
