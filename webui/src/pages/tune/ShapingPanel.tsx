import { NativeSelect, useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asShaping } from '../../api/results'
import type { ShapingResult, ShapingSettings } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob } from '../../live/store'
import { CurvesPlot } from '../../plots/CurvesPlot'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useSay } from '../../widgets/profile-text/texts'
import { useAction } from '../../widgets/useAction'
import type { Limits } from '../response/limits'
import { useToolJob } from '../response/useToolJob'
import { shapingNotes, shapingRows, shapingTables } from './shaping'
import { amount, interval } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

const SHAPERS = ['auto', 'zv', 'zvd', 'ei'] as const

/** The slow vibration after a move, and the same move with a shaper. */
export function ShapingPanel({
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
  const { tool, text } = useTool('shaping')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  const [shaper, setShaper] = useState<(typeof SHAPERS)[number]>('auto')
  useEffect(() => setValues(initialValues(fields)), [fields])
  const { job, note, dismiss } = useToolJob(drive, 'shaping')
  const start = useAction()
  const result = asShaping(job?.result)
  if (!tool) return null
  const go = () =>
    start.run(async () => {
      if (!limits) return
      const body = { ...limits, cycle_ms: cycleMs, ...values, shaper } as ShapingSettings
      const params = { path: { drive_id: drive } }
      setJob(await ask(api.POST('/api/v1/drives/{drive_id}/jobs/shaping', { params, body })))
    })
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      <div className="fields wide">
        <NativeSelect
          label={text('field.shaper')}
          value={shaper}
          onChange={(event) => setShaper(event.currentTarget.value as typeof shaper)}
          data={SHAPERS.map((each) => ({ value: each, label: text(`shaper.${each}`) }))}
        />
      </div>
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
      {result && <ShapingAnswer drive={drive} result={result} text={text} />}
    </Panel>
  )
}

const COLORS = { light: ['#1a5c94', '#c2571a'], dark: ['#6db3f2', '#f0a060'] } as const

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
  const t = useT()
  const ofProfile = useSay(drive)
  const dark = useComputedColorScheme('light') === 'dark'
  const [first, second] = COLORS[dark ? 'dark' : 'light']
  const curves = useMemo(() => {
    const x = result.trace_s ?? []
    return [
      { label: text('line.unshaped'), color: second, x, y: result.trace_unshaped ?? [] },
      { label: text('line.shaped'), color: first, x, y: result.trace_shaped ?? [] },
    ]
  }, [result, text, first, second])
  const rows = shapingRows(result, text)
  return (
    <>
      {shapingNotes(result, text).map((each) => (
        <p key={each.words} className={`note ${each.tone}`}>
          {each.words}
        </p>
      ))}
      {result.signal && (result.trace_s ?? []).length > 0 && (
        <CurvesPlot
          curves={curves}
          xLabel={text('chart.time')}
          yLabel={text(`chart.${result.signal}`)}
          label={text('chart')}
          dark={dark}
        />
      )}
      {rows.length > 0 && (
        <div className="scroll-table">
          <table className="reported-values" aria-label={text('title')}>
            <thead>
              <tr>
                <th>{t('inertia.quantity')}</th>
                <th className="right">{t('inertia.value')}</th>
              </tr>
            </thead>
            <tbody className="num">
              {rows.map((row) => (
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
      )}
      {shapingTables(result, text, ofProfile).map((table) => (
        <div className="scroll-table" key={table.name}>
          <table className="reported-values of-lists" aria-label={table.name}>
            <thead>
              <tr>
                {table.head.map((each) => (
                  <th key={each}>{each}</th>
                ))}
              </tr>
            </thead>
            <tbody className="num">
              {table.rows.map((row) => (
                <tr key={row[0]}>
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
