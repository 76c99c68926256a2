import { NativeSelect, useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../api/client'
import { asGantry } from '../../api/results'
import type { GantryResult, GantrySettings } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { setJob, useAxisStates, useDrive, useDrives } from '../../live/store'
import { CurvesPlot } from '../../plots/CurvesPlot'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { StartButton } from '../../widgets/StartButton'
import { useAction } from '../../widgets/useAction'
import type { Limits } from '../response/limits'
import { useToolJob } from '../response/useToolJob'
import {
  type Candidate,
  candidatesOf,
  couplingCurve,
  gantryNotes,
  gantryRows,
  motionCurves,
} from './gantry'
import { amount, interval } from './steps'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

type Text = (name: string, values?: Record<string, string>) => string

/** Two axes of one machine, measured together. */
export function GantryPanel({
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
  const { tool, text } = useTool('gantry')
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  const [chosen, setChosen] = useState('')
  useEffect(() => setValues(initialValues(fields)), [fields])
  const { job, note, dismiss } = useToolJob(drive, 'gantry')
  const start = useAction()
  const candidates = useCandidates(drive)
  const first = useDrive(drive)?.name ?? drive
  // One that may no longer be the partner is not chosen any more.
  const partner = candidates.find((each) => each.id === chosen && each.missing === null) ?? null
  const result = asGantry(job?.result)
  if (!tool) return null
  const go = () =>
    start.run(async () => {
      if (!limits || !partner) return
      const settings = { ...limits, cycle_ms: cycleMs, ...values, partner: partner.id }
      const params = { path: { drive_id: drive } }
      const body = settings as GantrySettings
      setJob(await ask(api.POST('/api/v1/drives/{drive_id}/jobs/gantry', { params, body })))
    })
  const missing = !partner
    ? t('gantry.unchosen')
    : complete(fields, values)
      ? null
      : t('start.incomplete')
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      {candidates.every((each) => each.missing === 'segment') ? (
        <p className="note info">{t('gantry.alone')}</p>
      ) : (
        <>
          <PartnerField
            label={text('field.partner')}
            candidates={candidates}
            value={partner?.id ?? ''}
            onChange={setChosen}
          />
          <ToolForm
            tool={tool}
            limits={limits}
            fields={fields}
            values={values}
            text={text}
            onChange={setValues}
          />
          {limits && partner && (
            <p className="note warn">
              {text('danger', {
                first,
                second: partner.name,
                travel: String(limits.travel_limit),
                speed: String(limits.speed_limit),
                torque: String(limits.torque_limit),
              })}
            </p>
          )}
          <StartButton obstacle={obstacle ?? missing} busy={start.busy} onStart={() => void go()}>
            {text('start')}
          </StartButton>
        </>
      )}
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {result && <GantryAnswer result={result} first={first} text={text} />}
    </Panel>
  )
}

/** All other axes, as they are now. */
function useCandidates(drive: string): Candidate[] {
  const drives = useDrives() ?? []
  const states = useAxisStates(drives.map((each) => each.id))
  const own = drives.find((each) => each.id === drive)
  if (!own) return []
  return candidatesOf(
    own,
    drives.map((each, at) => [each, states[at] ?? null]),
  )
}

/** The partner, and why the others cannot be it. */
function PartnerField({
  label,
  candidates,
  value,
  onChange,
}: {
  label: string
  candidates: Candidate[]
  value: string
  onChange: (id: string) => void
}) {
  const t = useT()
  const say = useSay()
  const possible = candidates.filter((each) => each.missing === null)
  const others = candidates.filter((each) => each.missing !== null)
  const why = ({ missing }: Candidate) =>
    missing === null
      ? ''
      : missing === 'segment'
        ? t('gantry.segment')
        : [t(`tune.no.${missing.name}`), say.message(missing.message, missing.detail)]
            .join(' ')
            .trim()
  return (
    <>
      <div className="fields wide">
        <NativeSelect
          label={label}
          value={value}
          onChange={(event) => onChange(event.currentTarget.value)}
          data={[
            { value: '', label: t('gantry.choose') },
            ...possible.map((each) => ({ value: each.id, label: each.name })),
          ]}
        />
      </div>
      {others.length > 0 && (
        <details className="dim">
          <summary>{t('gantry.others')}</summary>
          <ul>
            {others.map((each) => (
              <li key={each.id}>
                {each.name}: {why(each)}
              </li>
            ))}
          </ul>
        </details>
      )}
    </>
  )
}

const COLORS = { light: ['#1a5c94', '#c2571a'], dark: ['#6db3f2', '#f0a060'] } as const

/** Verdict and findings, both motions and the coupling over frequency, and the figures. */
function GantryAnswer({
  result,
  first,
  text,
}: {
  result: GantryResult
  first: string
  text: Text
}) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const colors = COLORS[dark ? 'dark' : 'light']
  const motions = useMemo(
    () =>
      motionCurves(result, text).map((each, at) => ({ ...each, color: colors[at] ?? colors[0] })),
    [result, colors],
  )
  const coupling = useMemo(
    () => [{ ...couplingCurve(result, text), color: colors[0] }],
    [result, colors],
  )
  return (
    <>
      <p className="dim">{t('gantry.axes', { first, second: result.partner })}</p>
      {gantryNotes(result, text).map((each) => (
        <p key={each.words} className={`note ${each.tone}`}>
          {each.words}
        </p>
      ))}
      <CurvesPlot
        curves={motions}
        xLabel={text('frequency')}
        yLabel={text('magnitude')}
        label={text('motions')}
        dark={dark}
      />
      <CurvesPlot
        curves={coupling}
        xLabel={text('frequency')}
        yLabel={text('ratio')}
        label={text('coupling')}
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
            {gantryRows(result, text).map((row) => (
              <tr key={`${row.name} ${row.unit} ${row.value}`}>
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
