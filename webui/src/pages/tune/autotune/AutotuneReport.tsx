import { Button, useComputedColorScheme } from '@mantine/core'
import { useMemo, useState } from 'react'
import { api, ask } from '../../../api/client'
import { known, useSay, useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { ProcedureButton } from '../../../widgets/faults/Procedures'
import { useAction } from '../../../widgets/requests/useAction'
import { changedSince, noteUndone } from '../../response/design/undo'
import { hertz, measuredCurve, wrapWhole } from '../../response/plot/bode'
import { BodePlot } from '../../response/plot/BodePlot'
import { Legend } from '../../response/plot/Legend'
import { MarginList, ResonanceTable } from '../../response/plot/Readings'
import { type Autotune, filesOf } from '../../response/results'
import { usePrediction } from '../../response/design/usePrediction'
import { TRACE_COLORS } from '../../scope/setup/channels'
import { CandidateTable } from './CandidateTable'
import { forceOf } from './force'
import { InertiaResult } from '../steps/InertiaPanel'
import { StepNumbers } from '../steps/StepNumbers'
import { VerdictTable } from './VerdictTable'

const undone = new Set<string>()

/** Everything that was measured and decided, the verification, and the way back. */
export function AutotuneReport({
  drive,
  job,
  result,
  now,
  onChanged,
}: {
  drive: string
  job: string
  result: Autotune
  /** Gains that the drive holds now, raw; null where they are not known. */
  now: Record<string, number> | null
  onChanged: () => void
}) {
  const t = useT()
  const say = useSay()
  const notes = say.messages(result.note_messages, result.notes)
  const [pressed, setPressed] = useState(undone.has(job))
  const undo = useAction()
  const applied = result.applied
  const since = changedSince(undo.problem, result.before)
  const go = () =>
    undo.run(async () => {
      await ask(
        api.POST('/api/v1/drives/{drive_id}/tune/undo', {
          params: { path: { drive_id: drive } },
          body: { before: result.before, after: since ? null : (result.after ?? null) },
        }),
      )
      undone.add(job)
      noteUndone()
      setPressed(true)
      onChanged()
    })
  const reported = forceOf(result.before, result.after ?? {}, now ?? {})
  const force = pressed ? 'takenBack' : reported
  return (
    <>
      {applied && (
        <div className={`note ${force === 'acts' || force === 'kept' ? 'good' : 'info'}`}>
          <div className="row wrap middle">
            <span className="grow">
              {t(`autotune.force.${force}`, {
                mark: applied.marks.map((mark) => known(t, 'mark', mark)).join(', '),
              })}
            </span>
            {(force === 'acts' || force === 'changed') && (
              <Button loading={undo.busy} onClick={() => void go()}>
                {t(since ? 'undo.all' : 'undo.button')}
              </Button>
            )}
          </div>
          {force === 'acts' && (
            <div className="row wrap middle">
              <span className="grow">{t('autotune.save')}</span>
              <ProcedureButton drive={drive} name="save" label={t('parameters.save')} />
            </div>
          )}
        </div>
      )}
      <ProblemNote problem={undo.problem} onClose={undo.clear} />
      {notes.length > 0 && (
        <div className="note warn">
          <ul>
            {notes.map((each) => (
              <li key={each}>{each}</li>
            ))}
          </ul>
        </div>
      )}
      {result.tried.length > 0 && (
        <div className="note warn">
          {t('autotune.tried')}
          <ul>
            {say.messages(result.tried_messages, result.tried).map((each) => (
              <li key={each}>{each}</li>
            ))}
          </ul>
        </div>
      )}
      <Verification drive={drive} result={result} />
      {result.step && <StepNumbers step={result.step} />}
      <details>
        <summary>{t('autotune.measured')}</summary>
        <InertiaResult result={result.inertia} />
        <ResonanceTable sweep={result.mechanics} onNotch={null} />
      </details>
      <details>
        <summary>{t('candidate.title')}</summary>
        <p>{t('candidate.as', { load: known(t, 'load', result.load) })}</p>
        <CandidateTable candidates={result.candidates} onApply={null} />
      </details>
    </>
  )
}

/** The tuned loop as measured, over what was predicted for it. */
function Verification({ drive, result }: { drive: string; result: Autotune }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const colors = TRACE_COLORS[dark ? 'dark' : 'light']
  const { applied, verified, again } = result
  const file = filesOf(result).find((name) => name.includes('sweep-mechanics')) ?? null
  const inertia = result.inertia.inertia_kgm2
  const gains =
    applied && inertia !== null
      ? {
          speed_bandwidth_hz: applied.gains.speed_bandwidth_hz,
          integral_hz: applied.gains.integral_hz,
          position_1_s: applied.gains.position_1_s,
          inertia_kgm2: inertia,
        }
      : null
  const predicted = usePrediction(drive, file, applied?.notches ?? [], gains)
  const corrected = useMemo(() => {
    const { frequency_hz, closed_db, closed_deg } = again ?? {}
    if (!frequency_hz || !closed_db || !closed_deg) return null
    const label = t('autotune.predictedAgain')
    const shown = { magnitude: closed_db, phase: wrapWhole(closed_deg, frequency_hz) }
    return { label, color: colors[2] ?? '', dashed: true, frequency: frequency_hz, ...shown }
  }, [again, dark, t('autotune.predictedAgain')])
  const curves = useMemo(() => {
    if (!verified) return []
    const measured = measuredCurve(verified.sweep, t('response.measured'), colors[0] ?? '')
    const [low, high] = verified.sweep.valid_band_hz
    if (!predicted.found) return corrected ? [measured, corrected] : [measured]
    const { frequency_hz, closed_db, closed_deg } = predicted.found
    const inside = <V,>(values: V[]) =>
      values.filter((_, i) => {
        const f = frequency_hz[i] ?? 0
        return f >= low && f <= high
      })
    const before = {
      label: t(corrected ? 'autotune.predictedBefore' : 'autotune.predicted'),
      color: colors[1] ?? '',
      dashed: true,
      frequency: inside(frequency_hz),
      magnitude: inside(closed_db),
      phase: inside(closed_deg),
    }
    return corrected ? [measured, corrected, before] : [measured, before]
  }, [verified, predicted.found, dark, corrected, t('autotune.predicted')])
  if (!verified) return null
  return (
    <>
      <h3>{t('autotune.verification')}</h3>
      <p className="num">
        {t('autotune.bandwidths', {
          predicted: hertz(verified.predicted_bandwidth_hz),
          measured: hertz(verified.measured_bandwidth_hz),
        })}
      </p>
      {again && corrected && (
        <p className="num">
          {t('autotune.bandwidthsBefore', {
            predicted: hertz(again.predicted.bandwidth_hz),
            measured: hertz(again.measured.bandwidth_hz),
          })}
        </p>
      )}
      <Legend of={curves} />
      <BodePlot
        curves={curves}
        markers={[]}
        band={verified.sweep.valid_band_hz}
        shown={[
          Math.max(verified.sweep.frequency_hz[0] ?? 1, verified.sweep.valid_band_hz[0]),
          verified.sweep.valid_band_hz[1],
        ]}
        unit={verified.sweep.unit}
        label={t('autotune.verification')}
        dark={dark}
        onMarker={() => {}}
      />
      <MarginList margins={verified.sweep.margins} />
      {verified.verdict && <VerdictTable verdict={verified.verdict} />}
    </>
  )
}
