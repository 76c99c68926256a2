import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asCycle } from '../../api/results'
import type { CycleResult, CycleSettings } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob } from '../../live/store'
import { CurvesPlot } from '../../plots/CurvesPlot'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useAction } from '../../widgets/useAction'
import { useToolJob } from '../response/useToolJob'
import { cycleNotes, cycleRows } from './cycle'
import { amount, interval } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

/** The load of the machine's own cycle. Nothing moves, so nothing is agreed to before. */
export function CyclePanel({ drive, open }: { drive: string; open: boolean }) {
  const t = useT()
  const { tool, text } = useTool('cycle')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  useEffect(() => setValues(initialValues(fields)), [fields])
  const [recording, setRecording] = useState('')
  const names = useRecordingNames(open)
  const { job, note, dismiss } = useToolJob(drive, 'cycle')
  const start = useAction()
  const result = asCycle(job?.result)
  if (!tool) return null
  const go = () =>
    start.run(async () => {
      const body = { ...values, recording: recording || null } as CycleSettings
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/cycle', {
            params: { path: { drive_id: drive } },
            body,
          }),
        ),
      )
    })
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      <label className="field">
        <span>{text('source')}</span>
        <select value={recording} onChange={(event) => setRecording(event.target.value)}>
          <option value="">{text('source.drive')}</option>
          {names.map((name) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      <ToolForm
        tool={tool}
        limits={null}
        fields={fields.filter((each) => each.name !== 'duration_s' || recording === '')}
        values={values}
        text={text}
        onChange={setValues}
      />
      <StartButton
        obstacle={
          !open ? t('start.noConnection') : complete(fields, values) ? null : t('start.incomplete')
        }
        busy={start.busy || job?.state === 'running'}
        onStart={() => void go()}
      >
        {text(recording === '' ? 'start' : 'evaluate')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {result && <CycleAnswer result={result} text={text} />}
    </Panel>
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

const COLORS = { light: ['#1a5c94', '#c2571a'], dark: ['#6db3f2', '#f0a060'] } as const

/** Verdict and findings, torque over speed with its limits, and the figures. */
export function CycleAnswer({ result, text }: { result: CycleResult; text: Text }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const [first, second] = COLORS[dark ? 'dark' : 'light']
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
      {cycleNotes(result, text).map((each) => (
        <p key={each.words} className={`note ${each.tone}`}>
          {each.words}
        </p>
      ))}
      <CurvesPlot
        curves={curves}
        xLabel={text('speed')}
        yLabel={text('torque')}
        label={text('cloud')}
        dark={dark}
      />
      <div className="scroll-table">
        <table className="reported-values" aria-label={text('title')}>
          <thead>
            <tr>
              <th>{t('inertia.quantity')}</th>
              <th className="right">{t('inertia.value')}</th>
            </tr>
          </thead>
          <tbody className="num">
            {cycleRows(result, text).map((row) => (
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
