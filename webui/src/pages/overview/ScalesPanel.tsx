import { Button } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { ScaleInfo, ScalesInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { setJob, useAxisState } from '../../live/store'
import { figure } from '../../widgets/numbers/format'
import { JobNote, useJobEnd } from '../../widgets/jobs/JobNote'
import { NumberField } from '../../widgets/numbers/NumberField'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { StartButton } from '../../widgets/jobs/StartButton'
import { useAction } from '../../widgets/requests/useAction'
import { useWrong } from '../../widgets/numbers/useWrong'

/** Scales with their origins; folded while they are certain, with ways to teach them. */
export function ScalesPanel({ drive }: { drive: string }) {
  const t = useT()
  const [info, setInfo] = useState<ScalesInfo | null>(null)
  const act = useAction()
  const path = { path: { drive_id: drive } }
  const names = useAxisState(drive)?.units
  const load = useCallback(
    () =>
      act.run(async () =>
        setInfo(await ask(api.GET('/api/v1/drives/{drive_id}/scales', { params: path }))),
      ),
    [drive],
  )
  // Read again when the units that the axis shows change: somebody set the gear.
  useEffect(() => void load(), [drive, names?.position, names?.velocity])
  const change = (work: () => Promise<ScalesInfo>) => act.run(async () => setInfo(await work()))
  return (
    <Panel title={t('scales.title')}>
      <p className="dim">{t('scales.help')}</p>
      {info && (
        <>
          <p className={info.certain ? 'good-text' : 'note warn'}>
            {t(info.certain ? 'scales.certain' : 'scales.uncertain')}
          </p>
          <dl className="scale-list">
            {info.scales.map((scale) => (
              <One key={scale.quantity} scale={scale} />
            ))}
          </dl>
          {info.kept && !info.taught && <p className="note warn">{t('scales.expired')}</p>}
          <details open={!info.certain}>
            <summary>{t('scales.teach')}</summary>
            <Teach drive={drive} info={info} onChanged={() => void load()} change={change} />
          </details>
          <details>
            <summary>{t('scales.state')}</summary>
            <StateThem drive={drive} busy={act.busy} change={change} />
          </details>
          {info.kept && (
            <Button
              disabled={act.busy}
              onClick={() =>
                void change(() =>
                  ask(api.DELETE('/api/v1/drives/{drive_id}/scales', { params: path })),
                )
              }
            >
              {t('scales.forget')}
            </Button>
          )}
        </>
      )}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </Panel>
  )
}

function One({ scale }: { scale: ScaleInfo }) {
  const t = useT()
  return (
    <div>
      <dt>{t(`scales.quantity.${scale.quantity}`)}</dt>
      <dd>
        {scale.is_time
          ? t('scales.time')
          : scale.raw_per_unit !== null
            ? t('scales.per', { value: figure(scale.raw_per_unit, 6), unit: scale.unit })
            : scale.uncertainty && t(`scales.uncertainty.${scale.uncertainty}`)}{' '}
        <small className="dim">
          {t(`scales.origin.${scale.origin}`)}
          {scale.source && ` · ${scale.source}`}
        </small>
      </dd>
    </div>
  )
}

type Change = (work: () => Promise<ScalesInfo>) => Promise<unknown>

function Teach({
  drive,
  info,
  onChanged,
  change,
}: {
  drive: string
  info: ScalesInfo
  onChanged: () => void
  change: Change
}) {
  const t = useT()
  const act = useAction()
  const [increments, setIncrements] = useState<number | null>(500)
  const [torque, setTorque] = useState<number | null>(20)
  const [turned, setTurned] = useState<number | null>(null)
  const [job, setMoving] = useState<string | null>(null)
  const moves = info.small_moves
  useJobEnd(job, onChanged)
  const move = () =>
    act.run(async () => {
      const started = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/small_move', {
          params: { path: { drive_id: drive } },
          body: { increments: increments ?? 0, torque_limit: torque ?? 20, cycle_ms: 1 },
        }),
      )
      setJob(started)
      setMoving(started.id)
    })
  const confirm = () =>
    change(() =>
      ask(
        api.POST('/api/v1/drives/{drive_id}/scales/confirm', {
          params: { path: { drive_id: drive } },
          body: { turned_rev: turned ?? 0 },
        }),
      ),
    )
  const missing = increments === null || torque === null ? t('number.missing') : null
  return (
    <div className="stack">
      <p className="prose">{t('scales.teachHelp')}</p>
      <div className="row wrap">
        <NumberField
          label={t('scales.increments')}
          value={increments}
          onChange={setIncrements}
          integer
          min={-(moves?.next_most ?? 1000)}
          max={moves?.next_most ?? 1000}
        />
        <NumberField
          label={t('scales.torque')}
          unit="%"
          value={torque}
          onChange={setTorque}
          min={1}
          max={50}
        />
      </div>
      <StartButton obstacle={missing} busy={act.busy} onStart={() => void move()}>
        {t('scales.move')}
      </StartButton>
      <JobNote id={job} onClose={() => setMoving(null)} />
      {moves && (
        <>
          <p>
            {moves.raw_per_inc_s === null
              ? t('scales.toldNothing')
              : t('scales.reported', { value: figure(moves.raw_per_inc_s, 4) })}
          </p>
          <NumberField
            label={t('scales.turned')}
            unit="rev"
            value={turned}
            onChange={setTurned}
            help={t('scales.turnedHelp', { moved: moves.moved })}
            optional
          />
          <Button disabled={turned === null} onClick={() => void confirm()}>
            {t('scales.confirm')}
          </Button>
        </>
      )}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}

function StateThem({ drive, busy, change }: { drive: string; busy: boolean; change: Change }) {
  const t = useT()
  const [counts, setCounts] = useState<number | null>(null)
  const [perRpm, setPerRpm] = useState<number | null>(null)
  const [perRpmS, setPerRpmS] = useState<number | null>(null)
  const keep = () =>
    change(() =>
      ask(
        api.PUT('/api/v1/drives/{drive_id}/scales', {
          params: { path: { drive_id: drive } },
          body: { counts_per_rev: counts, raw_per_rpm: perRpm, raw_per_rpm_s: perRpmS },
        }),
      ),
    )
  const wrong = useWrong()
  const nothing = counts === null && perRpm === null && perRpmS === null
  return (
    <div className="stack">
      <NumberField
        label={t('scales.countsPerRev')}
        value={counts}
        onChange={setCounts}
        onWrong={wrong.of('counts')}
        above={0}
        optional
      />
      <NumberField
        label={t('scales.rawPerRpm')}
        value={perRpm}
        onChange={setPerRpm}
        onWrong={wrong.of('rpm')}
        above={0}
        optional
      />
      <NumberField
        label={t('scales.rawPerRpmS')}
        value={perRpmS}
        onChange={setPerRpmS}
        onWrong={wrong.of('rpmS')}
        above={0}
        optional
      />
      <Button disabled={nothing || wrong.any || busy} onClick={() => void keep()}>
        {t('scales.keep')}
      </Button>
    </div>
  )
}
