import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { LogEntry } from '../../api/schema'
import { useT } from '../../i18n'
import { useAxisState, useDrive, useLink, useLog } from '../../live/store'
import { FaultList } from '../../widgets/faults/FaultList'
import { FaultResetButton, FaultResetProblem, useFaultReset } from '../../widgets/faults/FaultReset'
import { dateTime } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { Said } from '../../widgets/messages/Said'
import { Bundles } from './Bundles'
import { History } from './History'

export function AlarmsPage({ drive }: { drive: string }) {
  const t = useT()
  const state = useAxisState(drive)
  const summary = useDrive(drive)
  const reset = useFaultReset(drive)
  const faults = state?.faults.filter((fault) => fault.kind === 'fault') ?? []
  const warnings = state?.faults.filter((fault) => fault.kind === 'warning') ?? []
  return (
    <div className="page">
      <h1>
        {t('page.alarms')} <small className="dim">{summary?.name}</small>
      </h1>
      <Panel
        title={t('faults.active')}
        tools={
          <FaultResetButton reset={reset} disabled={!state?.fresh || state.faults.length === 0} />
        }
      >
        <FaultResetProblem reset={reset} />
        {faults.length === 0 && (
          <p className={state?.fresh ? 'good-text' : 'dim'}>
            {t(state?.fresh ? 'faults.none' : 'state.noAnswer')}
          </p>
        )}
        <FaultList drive={drive} faults={faults} />
      </Panel>
      {warnings.length > 0 && (
        <Panel title={t('faults.warnings')}>
          <FaultList drive={drive} faults={warnings} />
        </Panel>
      )}
      <div className="columns">
        <History drive={drive} />
        <Bundles />
      </div>
      <Log drive={drive} />
    </div>
  )
}

/** The tool's own log of one axis: what was stored before, then what arrives. */
function Log({ drive }: { drive: string }) {
  const t = useT()
  const { open } = useLink()
  const streamed = useLog()
  const [stored, setStored] = useState<LogEntry[]>([])
  const [asked, setAsked] = useState('')
  useEffect(() => {
    if (!open) return
    let current = true
    ask(api.GET('/api/v1/drives/{drive_id}/log', { params: { path: { drive_id: drive } } })).then(
      (entries) => {
        if (!current) return
        setStored(entries)
        setAsked(entries[0]?.time ?? '')
      },
      () => {}, // asked again when the connection is back
    )
    return () => {
      current = false
    }
  }, [drive, open])
  const fresh = streamed
    .filter((entry) => (entry.drive === drive || entry.drive === null) && entry.time > asked)
    .toReversed()
  const entries = [...fresh, ...stored]
  return (
    <Panel title={t('log.title')}>
      {entries.length === 0 && <p className="dim">{t('log.empty')}</p>}
      <ul className="log">
        {entries.map((entry, i) => (
          <li key={`${entry.time} ${i}`} className={entry.level}>
            <time className="num dim">{dateTime(entry.time)}</time>
            <strong>{t(`log.${entry.level}`)}</strong>
            <span className="grow">
              <Said message={entry.message} words={entry.text} />
            </span>
            <span className="dim">{entry.person}</span>
          </li>
        ))}
      </ul>
    </Panel>
  )
}
