import { useEffect } from 'react'
import { api, ask } from '../../api/client'
import type { IoInfo, ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { useAxisState, useDrive, useLink, useReading } from '../../live/store'
import { clock, hexadecimal } from '../../widgets/numbers/format'
import { DIGITAL_INPUTS, DIGITAL_OUTPUTS } from '../../widgets/parameters/objects'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterFields } from '../../widgets/parameters/ParameterFields'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { bitFields, getField } from '../../widgets/numbers/parse'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useRows } from '../../widgets/profile-text/rows'
import { useSay } from '../../widgets/profile-text/texts'
import { Said } from '../../widgets/messages/Said'
import { useFetched, useFunctions } from '../../widgets/drive/useFunctions'
import { ForcingPanel } from './ForcingPanel'
import { probeKeys } from './probe'
import { ProbePanel } from './ProbePanel'
import { TerminalTable } from './TerminalTable'

const PERIOD_S = 0.1

/** Terminals: as they are, what they are for, overruling them, and touch probes. */
export function IoPage({ drive }: { drive: string }) {
  const t = useT()
  const say = useSay(drive)
  const rows = useRows(drive)
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const functions = useFunctions(drive)
  const { open } = useLink()
  const io = useFetched<IoInfo>(
    () => ask(api.GET('/api/v1/drives/{drive_id}/io', { params: { path: { drive_id: drive } } })),
    [drive],
  )
  const reachable = new Set((rows ?? []).filter((row) => row.reachable).map((row) => row.key))
  const objects = (rows ?? []).filter(
    (row) => row.reachable && (row.key === DIGITAL_INPUTS || row.key === DIGITAL_OUTPUTS),
  )
  const watched = [
    ...new Set([
      ...objects.map((row) => row.key),
      ...(functions?.terminals.states ?? []).map((place) => place.key),
      ...probeKeys(functions?.probe ?? null),
    ]),
  ]
    .filter((key) => reachable.has(key))
    .join(' ')
  useEffect(() => {
    if (open && rows === null) void live.loadRows(drive).catch(() => {})
  }, [drive, open, rows])
  useEffect(() => {
    if (watched === '') return
    live.stand(`values ${drive}`, {
      type: 'watch_values',
      drive,
      keys: watched.split(' '),
      period_s: PERIOD_S,
    })
    return () => {
      live.stand(`values ${drive}`, null)
      live.send({ type: 'watch_values', drive, keys: [], period_s: PERIOD_S })
    }
  }, [drive, watched])
  const terminals = io.data?.terminals ?? []
  const enabled = state?.state === 'Operation enabled'
  const groups = functions?.groups.filter((group) => group.page === 'io') ?? []
  const nothing =
    rows && io.data && objects.length === 0 && terminals.length === 0 && !functions?.probe
  return (
    <div className="page">
      <h1>
        {t('page.io')} <small className="dim">{summary?.name}</small>
      </h1>
      <ProblemNote problem={io.problem} />
      {enabled && terminals.length > 0 && <p className="note info">{t('io.stopFirst')}</p>}
      <div className="columns">
        {(['in', 'out'] as const).map((direction) => {
          const shown = terminals.filter((each) => each.direction === direction)
          return (
            shown.length > 0 && (
              <Panel key={direction} title={t(direction === 'in' ? 'io.inputs' : 'io.outputs')}>
                <TerminalTable
                  drive={drive}
                  terminals={shown}
                  states={functions?.terminals.states ?? []}
                  onChanged={io.read}
                />
              </Panel>
            )
          )
        })}
        {io.data?.forcing.map((forcing) => (
          <ForcingPanel
            key={forcing.name}
            drive={drive}
            forcing={forcing}
            onChanged={() => void io.read()}
          />
        ))}
        {functions?.probe && <ProbePanel drive={drive} probe={functions.probe} />}
        {groups.map((group) => (
          <Panel key={group.name} title={say(group.title)}>
            {group.help && (
              <p className="dim">
                <ProfileText drive={drive} text={group.help} />
              </p>
            )}
            <ParameterFields drive={drive} keys={group.keys} />
          </Panel>
        ))}
        {objects.map((row) => (
          <Bits key={row.key} drive={drive} row={row} />
        ))}
      </div>
      {io.data?.notes && (
        <p className="dim">
          <ProfileText drive={drive} text={io.data.notes} />
        </p>
      )}
      {nothing && <p className="empty">{t('io.none')}</p>}
    </div>
  )
}

function Bits({ drive, row }: { drive: string; row: ParameterRow }) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const raw = typeof reading.raw === 'number' ? reading.raw : null
  const fields = bitFields(row)
  return (
    <Panel title={`${t('io.objects')}: ${row.name}`}>
      <p className="dim mono">
        {row.key} {raw !== null && hexadecimal(raw, row.type)}{' '}
        {t('io.at', { time: clock(reading.time) })}
      </p>
      {reading.error && (
        <p className="note fault">
          <Said message={reading.error_message} words={reading.error} />
        </p>
      )}
      <ul className="io-bits">
        {fields.map((field) => {
          const value = raw === null ? null : getField(raw, field)
          return (
            <li key={field.low} className={value ? 'on' : ''}>
              <span className="lamp" aria-hidden="true">
                {value ? '●' : '○'}
              </span>
              <span className="grow">{field.label}</span>
              <strong>
                {value === null ? '—' : field.width > 1 ? value : t(value ? 'io.on' : 'io.off')}
              </strong>
            </li>
          )
        })}
      </ul>
      {fields.length === 0 && <p>{t('io.noBits')}</p>}
    </Panel>
  )
}
