import { Button, Modal, NativeSelect } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { GainWrite } from '../../../api/schema'
import { href } from '../../../app/navigation/router'
import { useSay, useT } from '../../../i18n'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { fixed, hertz } from '../../response/plot/bode'
import { GainFields, type PartialGains, whole } from '../../response/design/GainFields'
import { remember } from '../../response/design/undo'
import { UndoNote } from '../../response/design/UndoNote'
import type { useGains } from '../../response/design/useGains'
import { engineering } from './steps'

/** Gains or stiffness level, as far as the drive's profile knows them. */
export function GainsPanel({
  drive,
  of,
  inertia,
}: {
  drive: string
  of: ReturnType<typeof useGains>
  /** Of the last measurement, in kg·m². */
  inertia: number | null
}) {
  const t = useT()
  const say = useSay()
  const { gains } = of
  const [typed, setTyped] = useState<PartialGains | null>(null)
  const [level, setLevel] = useState<number | null>(null)
  const [asked, setAsked] = useState<GainWrite | null>(null)
  const write = useAction()
  const shape = gains?.convention === 'unit' ? null : gains
  const key = JSON.stringify(gains)
  useEffect(() => {
    if (!gains) return
    setTyped({
      speed_bandwidth_hz: rounded(gains.speed_hz),
      integral_hz: rounded(gains.integral_hz),
      position_1_s: rounded(gains.position_1_s),
      inertia_kgm2: rounded(gains.inertia_kgm2),
    })
    setLevel(gains.level ?? gains.levels[0] ?? null)
  }, [key])
  if (!gains) {
    return of.problem ? (
      <Panel title={t('gains.title')}>
        <p className="dim">{say.detail(of.problem)}</p>
        {of.problem.remedy && (
          <p className="dim">
            {t('problem.try')} {say.remedy(of.problem)}
          </p>
        )}
      </Panel>
    ) : null
  }
  const go = (body: GainWrite) =>
    write.run(async () => {
      const done = await ask(
        api.PUT('/api/v1/drives/{drive_id}/gains', {
          params: { path: { drive_id: drive } },
          body,
        }),
      )
      remember(drive, 'gains', done)
      await of.read()
    })
  const values = typed ? whole(typed) : null
  return (
    <Panel
      title={t('gains.title')}
      tools={<Button onClick={() => void of.read()}>{t('notch.read')}</Button>}
    >
      <p>
        <a href={href('gains', drive)}>{t('gains.toPage')}</a>
      </p>
      <p>
        {gains.level !== null
          ? t('gains.byLevel', { level: gains.level })
          : t(shape ? 'gains.byGains' : 'gains.byUnit')}
      </p>
      {shape && (
        <dl className="counters num">
          <div>
            <dt>{t('gain.speed')}</dt>
            <dd>{hertz(gains.speed_hz)}</dd>
          </div>
          <div>
            <dt>{t('gain.integral')}</dt>
            <dd>{hertz(gains.integral_hz)}</dd>
          </div>
          <div>
            <dt>{t('gain.position')}</dt>
            <dd>{fixed(gains.position_1_s, 1, '1/s')}</dd>
          </div>
          <div>
            <dt>{t('gains.inertia')}</dt>
            <dd>
              {gains.inertia_kgm2 === null ? '—' : `${engineering(gains.inertia_kgm2)} kg·m²`}
            </dd>
          </div>
          <div>
            <dt>{t('gains.current')}</dt>
            <dd>{hertz(gains.current_bandwidth_hz)}</dd>
          </div>
        </dl>
      )}
      {gains.levels.length > 0 && (
        <div className="row wrap">
          <NativeSelect
            label={t('gains.level')}
            value={String(level ?? '')}
            onChange={(event) => setLevel(Number(event.currentTarget.value))}
            data={gains.levels.map((each) => ({ value: String(each), label: String(each) }))}
          />
          <Button
            disabled={level === null || level === gains.level || write.busy}
            onClick={() => setAsked({ level })}
          >
            {t('gains.writeLevel')}
          </Button>
        </div>
      )}
      {shape && typed && (
        <details>
          <summary>{t('gains.own')}</summary>
          <GainFields gains={typed} onChange={setTyped} />
          <div className="row wrap">
            {inertia !== null && typed.inertia_kgm2 !== rounded(inertia) && (
              <Button onClick={() => setTyped({ ...typed, inertia_kgm2: rounded(inertia) })}>
                {t('gains.takeInertia', { value: engineering(inertia) })}
              </Button>
            )}
            <Button
              disabled={values === null || write.busy}
              onClick={() => setAsked({ gains: values })}
            >
              {t('gains.write')}
            </Button>
          </div>
        </details>
      )}
      <ProblemNote problem={write.problem} onClose={write.clear} />
      <UndoNote drive={drive} onUndone={() => void of.read()} />
      {asked && (
        <Modal opened onClose={() => setAsked(null)} title={t('gains.write')}>
          <p>{t('gains.confirm')}</p>
          {asked.level != null && <p>{t('gains.byLevel', { level: asked.level })}</p>}
          <div className="row end">
            <Button onClick={() => setAsked(null)}>{t('cancel')}</Button>
            <Button
              variant="filled"
              onClick={() => {
                setAsked(null)
                void go(asked)
              }}
            >
              {t('notch.writeNow')}
            </Button>
          </div>
        </Modal>
      )}
    </Panel>
  )
}

const rounded = (value: number | null) => (value === null ? null : Number(value.toPrecision(4)))
