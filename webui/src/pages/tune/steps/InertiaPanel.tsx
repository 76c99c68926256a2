import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AxisState } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { JobNote } from '../../../widgets/jobs/JobNote'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { useAction } from '../../../widgets/requests/useAction'
import { useWrong } from '../../../widgets/numbers/useWrong'
import { fixed } from '../../response/plot/bode'
import { asInertia, type Inertia } from '../../response/results'
import { useToolJob } from '../../response/useToolJob'
import { ValuesTable } from '../tools/form/Answer'
import { MotionWarning } from './MotionWarning'
import { SchemeFields, useScheme } from './schemes'
import type { Measured } from '../tools/form/ToolPanel'

const MOVES = {
  free: 'tool.moves',
  limited: 'inertia.movesLimited',
  taught: 'inertia.movesTaught',
} as const

/** Inertia and friction, by reciprocating moves. */
export function InertiaPanel({
  drive,
  state,
  limits,
  obstacle,
  cycleMs,
}: Measured & { state: AxisState | null }) {
  const t = useT()
  const scheme = useScheme()
  const [repetitions, setRepetitions] = useState<number | null>(4)
  const [motor, setMotor] = useState<number | null>(null)
  const wrong = useWrong()
  const [searchTorque, setSearchTorque] = useState<number | null>(20)
  const [searchSpeed, setSearchSpeed] = useState<number | null>(30)
  const { job, note, dismiss } = useToolJob(drive, 'inertia')
  const start = useAction()
  const result = asInertia(job?.result)
  const complete =
    limits !== null &&
    !wrong.any &&
    repetitions !== null &&
    scheme.complete &&
    searchTorque !== null &&
    searchSpeed !== null
  const go = () =>
    start.run(async () => {
      if (!limits || repetitions === null || searchTorque === null || searchSpeed === null) return
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/inertia', {
            params: { path: { drive_id: drive } },
            body: {
              ...limits,
              cycle_ms: cycleMs,
              scheme: scheme.scheme,
              ends_rev: scheme.ends,
              search_torque: searchTorque,
              search_speed: searchSpeed,
              repetitions,
              motor_inertia_kgm2: motor,
            },
          }),
        ),
      )
    })
  return (
    <Panel title={t('inertia.title')}>
      <p className="dim">{t('inertia.lead')}</p>
      <SchemeFields of={scheme} state={state} />
      <div className="fields">
        {scheme.scheme === 'limited' && (
          <>
            <NumberField
              label={t('inertia.searchTorque')}
              unit="%"
              value={searchTorque}
              onChange={setSearchTorque}
              above={0}
              max={100}
            />
            <NumberField
              label={t('inertia.searchSpeed')}
              unit="rpm"
              value={searchSpeed}
              onChange={setSearchSpeed}
              above={0}
            />
          </>
        )}
        <NumberField
          label={t('inertia.repetitions')}
          value={repetitions}
          onChange={setRepetitions}
          min={1}
          max={10}
          integer
        />
        <NumberField
          label={t('inertia.motor')}
          unit="kg·m²"
          value={motor}
          onChange={setMotor}
          onWrong={wrong.of('motor')}
          above={0}
          optional
          help={t('inertia.motorHelp')}
        />
      </div>
      {limits && <MotionWarning limits={limits} words={MOVES[scheme.scheme]} />}
      <StartButton
        obstacle={obstacle ?? (complete ? null : t('start.incomplete'))}
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('inertia.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {result && <InertiaResult result={result} />}
    </Panel>
  )
}

const ROWS = [
  { name: 'inertia_kgm2', text: 'inertia.inertia', unit: 'kg·m²' },
  { name: 'load_ratio', text: 'inertia.ratio', unit: '' },
  { name: 'coulomb_nm', text: 'inertia.coulomb', unit: 'N·m' },
  { name: 'viscous_nms', text: 'inertia.viscous', unit: 'N·m·s/rad' },
  { name: 'gravity_nm', text: 'inertia.gravity', unit: 'N·m' },
] as const

/** What few machines have: shown where it was found. */
const LOAD_ROWS = [
  { name: 'place_nm', text: 'inertia.place', help: 'inertia.placeHelp', unit: 'N·m' },
  { name: 'fan_nm', text: 'inertia.fan', help: 'inertia.fanHelp', unit: 'N·m' },
] as const

/** What was found, how sure it is, and whether the data support it at all. */
export function InertiaResult({ result }: { result: Inertia }) {
  const t = useT()
  const say = useSay()
  const reasons = say.messages(
    result.reasons?.map((code) => ({ code: `inertia.${code}` })),
    result.identifiable ? [] : [result.verdict ?? ''],
  )
  const reference = result.load_ratio_reference
  const against = say.message(
    reference && { code: `inertia.ratio-to-${reference}` },
    result.load_ratio_against,
  )
  const si = result.unit === 'SI'
  const loadRows = LOAD_ROWS.filter(({ name }) => result[name] != null)
  const rows = [...ROWS, ...loadRows]
  return (
    <>
      <p className={`note ${result.identifiable ? 'good' : 'warn'}`}>
        <strong>{t(result.identifiable ? 'inertia.sure' : 'inertia.unsure')}</strong>{' '}
        {reasons.join('\n')}
      </p>
      <ValuesTable
        label={t('inertia.title')}
        rows={rows.map(({ name, text, unit }) => ({
          name: t(text),
          value: result[name] ?? null,
          unit: si ? unit : '',
          ends: name in result.ci95 ? result.ci95[name as keyof Inertia['ci95']] : null,
        }))}
      />
      <p className="dim">
        {!si && `${t('inertia.perRated')} `}
        {t('inertia.fit', { r2: fixed(result.r2, 4) })}
        {against && ` ${t('inertia.against', { what: against })}`}
        {loadRows.map(({ help }) => ` ${t(help)}`)}
      </p>
    </>
  )
}
