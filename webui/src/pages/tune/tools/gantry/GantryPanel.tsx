import { NativeSelect } from '@mantine/core'
import { useMemo, useState } from 'react'
import { resultOf } from '../../../../api/results'
import type { GantryResult } from '../../../../api/schema'
import { useSay, useT } from '../../../../i18n'
import { useAxisStates, useDrive, useDrives } from '../../../../live/store'
import { CurvesPlot } from '../../../../plots/CurvesPlot'
import { Notes, useCurveColors, ValuesTable } from '../form/Answer'
import {
  type Candidate,
  candidatesOf,
  couplingCurve,
  gantryNotes,
  gantryRows,
  motionCurves,
} from './gantry'
import type { Text } from '../form/shown'
import { type Measured, MeasuredStart, ToolPanel, useToolRun } from '../form/ToolPanel'

/** Two axes of one machine, measured together. */
export function GantryPanel(measured: Measured) {
  const { drive, limits } = measured
  const t = useT()
  const run = useToolRun('gantry', drive)
  const { text } = run
  const [chosen, setChosen] = useState('')
  const candidates = useCandidates(drive)
  const first = useDrive(drive)?.name ?? drive
  // One that may no longer be the partner is not chosen any more.
  const partner = candidates.find((each) => each.id === chosen && each.missing === null) ?? null
  const result = resultOf('gantry', run.job?.result)
  return (
    <ToolPanel
      run={run}
      answer={result && <GantryAnswer result={result} first={first} text={text} />}
    >
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
          <MeasuredStart
            run={run}
            measured={measured}
            asked={{ partner: partner?.id }}
            missing={partner ? null : t('gantry.unchosen')}
            warning={
              limits &&
              partner && (
                <p className="note warn">
                  {text('danger', {
                    first,
                    second: partner.name,
                    travel: String(limits.travel_limit),
                    speed: String(limits.speed_limit),
                    torque: String(limits.torque_limit),
                  })}
                </p>
              )
            }
          />
        </>
      )}
    </ToolPanel>
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
  const colors = useCurveColors()
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
      <Notes notes={gantryNotes(result, text)} />
      <CurvesPlot
        curves={motions}
        xLabel={text('frequency')}
        yLabel={text('magnitude')}
        label={text('motions')}
      />
      <CurvesPlot
        curves={coupling}
        xLabel={text('frequency')}
        yLabel={text('ratio')}
        label={text('coupling')}
      />
      <ValuesTable rows={gantryRows(result, text)} label={text('title')} />
    </>
  )
}
