import { Button, Checkbox, NativeSelect } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Probe, TouchProbe } from '../../api/schema'
import { useT } from '../../i18n'
import { setReadings, useReading } from '../../live/store'
import { clock } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useRows } from '../../widgets/profile-text/rows'
import { useSay } from '../../widgets/profile-text/texts'
import { useAction } from '../../widgets/requests/useAction'
import { type ProbeSettings, probeSettings } from './probe'

export function ProbePanel({ drive, probe }: { drive: string; probe: TouchProbe }) {
  const t = useT()
  const rows = useRows(drive) ?? []
  if (!rows.some((row) => row.key === probe.function_key && row.reachable)) return null
  return (
    <Panel title={t('probe.title')}>
      {probe.notes && (
        <p className="prose">
          <ProfileText drive={drive} text={probe.notes} />
        </p>
      )}
      {probe.probes.map((each, i) => (
        <OneProbe key={i} drive={drive} probe={probe} one={each} number={i + 1} />
      ))}
      <p className="dim">{t('source', { source: probe.source })}</p>
    </Panel>
  )
}

function OneProbe({
  drive,
  probe,
  one,
  number,
}: {
  drive: string
  probe: TouchProbe
  one: Probe
  number: number
}) {
  const t = useT()
  const say = useSay(drive)
  const written = useReading(drive, probe.function_key)?.raw
  const status = useReading(drive, probe.status_key)?.raw
  const act = useAction()
  const [form, setForm] = useState<ProbeSettings | null>(null)
  const now = typeof written === 'number' ? probeSettings(written, number) : null
  useEffect(() => setForm(null), [drive])
  const value = form ?? now ?? probeSettings(0x10, 1)
  const edit = (part: Partial<ProbeSettings>) => setForm({ ...value, ...part })
  const write = () =>
    act.run(async () => {
      setReadings(drive, [
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/io/probes/{number}', {
            params: { path: { drive_id: drive, number } },
            body: value,
          }),
        ),
      ])
      setForm(null)
    })
  const bits = typeof status === 'number' ? (status >> (8 * (number - 1))) & 0xff : 0
  const sources = Object.entries(one.sources)
  return (
    <fieldset className="probe">
      <legend>{t('probe.number', { number })}</legend>
      <div className="row wrap middle">
        <Checkbox
          label={t('probe.on')}
          checked={value.on}
          onChange={(event) => edit({ on: event.currentTarget.checked })}
        />
        <Checkbox
          label={t('probe.rising')}
          checked={value.rising}
          onChange={(event) => edit({ rising: event.currentTarget.checked })}
        />
        <Checkbox
          label={t('probe.falling')}
          checked={value.falling}
          onChange={(event) => edit({ falling: event.currentTarget.checked })}
        />
        <Checkbox
          label={t('probe.continuous')}
          checked={value.continuous}
          onChange={(event) => edit({ continuous: event.currentTarget.checked })}
        />
      </div>
      <div className="row wrap">
        {sources.length > 1 ? (
          <NativeSelect
            label={t('probe.source')}
            value={String(value.source)}
            onChange={(event) => edit({ source: Number(event.currentTarget.value) })}
            data={sources.map(([code, label]) => ({ value: code, label: say(label) }))}
          />
        ) : (
          <p>
            {t('probe.source')}: {say(sources[0]?.[1] ?? '')}
          </p>
        )}
        <Button loading={act.busy} disabled={form === null} onClick={() => void write()}>
          {t('probe.write')}
        </Button>
      </div>
      <dl className="latched">
        <Latched
          drive={drive}
          name={t('probe.rising')}
          at={one.rising_key ?? null}
          set={bits & 2}
          on={bits & 1}
        />
        <Latched
          drive={drive}
          name={t('probe.falling')}
          at={one.falling_key ?? null}
          set={bits & 4}
          on={bits & 1}
        />
      </dl>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </fieldset>
  )
}

function Latched({
  drive,
  name,
  at,
  set,
  on,
}: {
  drive: string
  name: string
  at: string | null
  set: number
  on: number
}) {
  const t = useT()
  const reading = useReading(drive, at ?? '')
  const row = (useRows(drive) ?? []).find((each) => each.key === at)
  if (!row) return null
  return (
    <div>
      <dt>{name}</dt>
      <dd>
        <strong className="num">{reading?.value ?? '—'}</strong>{' '}
        <span className="unit">{row.unit}</span>{' '}
        <small className={set ? 'good-text' : 'dim'}>
          {t(set ? 'probe.latched' : on ? 'probe.waiting' : 'probe.off')}{' '}
          {set !== 0 && clock(reading?.time ?? null)}
        </small>
      </dd>
    </div>
  )
}
