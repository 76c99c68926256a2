import { NativeSelect } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../../../api/client'
import { resultOf } from '../../../../api/results'
import type { CycleResult } from '../../../../api/schema'
import { useT } from '../../../../i18n'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { Notes, useCurveColors, ValuesTable } from '../form/Answer'
import { cycleNotes, cycleRows } from './cycle'
import type { Text } from '../form/shown'
import { ToolPanel, ToolStart, useToolRun } from '../form/ToolPanel'

/** The load of the machine's own cycle. Nothing moves, so nothing is agreed to before. */
export function CyclePanel({ drive, open }: { drive: string; open: boolean }) {
  const t = useT()
  const run = useToolRun('cycle', drive)
  const { text, job } = run
  const [recording, setRecording] = useState('')
  const names = useRecordingNames(open)
  const result = resultOf('cycle', job?.result)
  const recorded = recording !== ''
  return (
    <ToolPanel run={run} answer={result && <CycleAnswer result={result} text={text} />}>
      <div className="fields wide">
        <NativeSelect
          label={text('source')}
          value={recording}
          onChange={(event) => setRecording(event.currentTarget.value)}
          data={[
            { value: '', label: text('source.drive') },
            ...names.map((name) => ({ value: name, label: name })),
          ]}
        />
      </div>
      <ToolStart
        run={run}
        obstacle={open ? null : t('start.noConnection')}
        busy={job?.state === 'running'}
        label={recorded ? 'evaluate' : 'start'}
        {...(recorded ? { without: 'duration_s' } : {})}
        onStart={() => run.begin({ ...run.values, recording: recording || null })}
      />
    </ToolPanel>
  )
}

/** Names of the recordings of this station, asked for once. */
function useRecordingNames(open: boolean): string[] {
  const [names, setNames] = useState<string[]>([])
  useEffect(() => {
    if (!open) return
    let current = true
    ask(api.GET('/api/v1/recordings', { params: { query: { search: '' } } })).then(
      (found) => current && setNames(found.recordings.map((each) => each.name)),
      () => undefined,
    )
    return () => {
      current = false
    }
  }, [open])
  return names
}

/** Verdict and findings, torque over speed with its limits, and the figures. */
function CycleAnswer({ result, text }: { result: CycleResult; text: Text }) {
  const [first, second] = useCurveColors()
  const curves = useMemo(() => {
    const { cloud_speed_rpm: x, cloud_torque_percent: y } = result
    const ends = [x[0] ?? 0, x.at(-1) ?? 1]
    const across = (name: string, level: number) => ({
      label: text(name),
      color: second,
      x: ends,
      y: [level, level],
    })
    const limit = result.peak_limit_percent
    return [
      { label: text('samples'), color: first, points: true, x, y },
      across('rated', 100),
      across('rated', -100),
      ...(limit == null ? [] : [across('limit', limit), across('limit', -limit)]),
    ]
  }, [result, first, second])
  return (
    <>
      <Notes notes={cycleNotes(result, text)} />
      <CurvesPlot
        curves={curves}
        xLabel={text('speed')}
        yLabel={text('torque')}
        label={text('cloud')}
      />
      <ValuesTable rows={cycleRows(result, text)} label={text('title')} />
    </>
  )
}
