import { NativeSelect } from '@mantine/core'
import { useMemo, useState } from 'react'
import { resultOf } from '../../../../api/results'
import type { ShapingResult } from '../../../../api/schema'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { useSay } from '../../../../widgets/profile-text/texts'
import { ListTables, Notes, useCurveColors, ValuesTable } from '../form/Answer'
import { shapingNotes, shapingRows, shapingTables } from './shaping'
import type { Text } from '../form/shown'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../form/ToolPanel'

const SHAPERS = ['auto', 'zv', 'zvd', 'ei'] as const

/** The slow vibration after a move, and the same move with a shaper. */
export function ShapingPanel(measured: Measured) {
  const run = useToolRun('shaping', measured.drive)
  const { text } = run
  const [shaper, setShaper] = useState<(typeof SHAPERS)[number]>('auto')
  const result = resultOf('shaping', run.job?.result)
  return (
    <ToolPanel
      run={run}
      answer={result && <ShapingAnswer drive={measured.drive} result={result} text={text} />}
    >
      <div className="fields wide">
        <NativeSelect
          label={text('field.shaper')}
          value={shaper}
          onChange={(event) => setShaper(event.currentTarget.value as typeof shaper)}
          data={SHAPERS.map((each) => ({ value: each, label: text(`shaper.${each}`) }))}
        />
      </div>
      <MeasuredStart run={run} measured={measured} asked={{ shaper }} />
    </ToolPanel>
  )
}

/** Verdict and findings, both traces, mode and comparison, and the shapers. */
function ShapingAnswer({
  drive,
  result,
  text,
}: {
  drive: string
  result: ShapingResult
  text: Text
}) {
  const ofProfile = useSay(drive)
  const [first, second] = useCurveColors()
  const curves = useMemo(() => {
    const x = result.trace_s ?? []
    return [
      { label: text('line.unshaped'), color: second, x, y: result.trace_unshaped ?? [] },
      { label: text('line.shaped'), color: first, x, y: result.trace_shaped ?? [] },
    ]
  }, [result, text, first, second])
  return (
    <>
      <Notes notes={shapingNotes(result, text)} />
      {result.signal && (result.trace_s ?? []).length > 0 && (
        <CurvesPlot
          curves={curves}
          xLabel={text('chart.time')}
          yLabel={text(`chart.${result.signal}`)}
          label={text('chart')}
        />
      )}
      <ValuesTable rows={shapingRows(result, text)} label={text('title')} />
      <ListTables tables={shapingTables(result, text, ofProfile)} />
    </>
  )
}
