import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asLoadSide } from '../../api/results'
import type { LoadSideResult, LoadSideSettings } from '../../api/schema'
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
import { loadSideNotes, loadSideRows } from './loadSide'
import { amount, interval } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

/** Backlash, stiffness and transmission error, where the drive reports a second position. */
export function LoadSidePanel({
  drive,
  limits,
  obstacle,
  cycleMs,
}: {
  drive: string
  limits: Limits | null
  /** What is in the way of a measurement, in words. */
  obstacle: string | null
  cycleMs: number
}) {
  const t = useT()
  const { tool, text } = useTool('load-side')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  useEffect(() => setValues(initialValues(fields)), [fields])
  const { job, note, dismiss } = useToolJob(drive, 'load-side')
  const start = useAction()
  const result = asLoadSide(job?.result)
  if (!tool) return null
  const go = () =>
    start.run(async () => {
      if (!limits) return
      const body = { ...limits, cycle_ms: cycleMs, ...values } as LoadSideSettings
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/load-side', {
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
      {result && <LoadSideAnswer result={result} text={text} />}
    </Panel>
  )
}

const COLORS = { light: '#1a5c94', dark: '#6db3f2' } as const

/** Verdict and findings, the error over the load's angle, and the figures with their intervals. */
export function LoadSideAnswer({ result, text }: { result: LoadSideResult; text: Text }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const color = COLORS[dark ? 'dark' : 'light']
  const curves = useMemo(
    () => [{ label: text('curve'), color, x: result.error_angle_deg, y: result.error_deg }],
    [result, color],
  )
  return (
    <>
      {loadSideNotes(result, text).map((each) => (
        <p key={each.words} className={`note ${each.tone}`}>
          {each.words}
        </p>
      ))}
      <CurvesPlot
        curves={curves}
        xLabel={text('angle')}
        yLabel={text('error')}
        label={text('over_angle')}
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
            {loadSideRows(result, text).map((row) => (
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
