import '../../widgets/layout/functions.css'
import { ActionIcon, Autocomplete } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { serverNow } from '../../live/server-clock'
import { useLink, useReading } from '../../live/store'
import { duration } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useRows } from '../../widgets/profile-text/rows'
import { Said } from '../../widgets/messages/Said'
import { useAction } from '../../widgets/requests/useAction'
import { setRecord, useRecord } from '../../widgets/drive/useFunctions'
import { readingText } from '../parameters/GridRow'

const PERIOD_S = 0.5
/** Older than this, a value is reported with its age. */
const FRESH_MS = 3000

const label = (row: ParameterRow) => `${row.name} · ${row.number ?? row.key}`

/** Any parameters, live; the list is kept on the bench for whoever comes next. */
export function WatchPanel({ drive }: { drive: string }) {
  const t = useT()
  const { open } = useLink()
  const rows = useRows(drive)
  const record = useRecord(drive)
  const act = useAction()
  const [text, setText] = useState('')
  const watch = record?.watch ?? []
  useEffect(() => {
    if (open && rows === null) void live.loadRows(drive).catch(() => {})
  }, [drive, open, rows])
  const readable = (rows ?? []).filter((row) => row.access !== 'wo' && row.reachable)
  const shown = watch.flatMap((key) => readable.filter((row) => row.key === key))
  const keys = shown.map((row) => row.key).join(' ')
  useEffect(() => {
    if (keys === '') return
    live.stand(`values ${drive}`, {
      type: 'watch_values',
      drive,
      keys: keys.split(' '),
      period_s: PERIOD_S,
    })
    return () => {
      live.stand(`values ${drive}`, null)
      live.send({ type: 'watch_values', drive, keys: [], period_s: PERIOD_S })
    }
  }, [drive, keys])
  const keep = (next: string[]) =>
    act.run(async () =>
      setRecord(
        drive,
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/watch', {
            params: { path: { drive_id: drive } },
            body: { keys: next },
          }),
        ),
      ),
    )
  const add = (chosen: string) => {
    const row = readable.find((each) => label(each) === chosen)
    if (!row) return
    setText('')
    void keep([...watch, row.key])
  }
  return (
    <Panel title={t('watch.title')}>
      <Autocomplete
        label={t('watch.add')}
        placeholder={t('watch.find')}
        value={text}
        limit={30}
        disabled={record === null}
        onChange={setText}
        onOptionSubmit={(chosen) => {
          add(chosen)
          // The field takes the chosen text after this; it is cleared once it has.
          setTimeout(() => setText(''), 0)
        }}
        data={[...new Set(readable.filter((row) => !watch.includes(row.key)).map(label))]}
        comboboxProps={{ zIndex: 200 }}
      />
      {shown.length === 0 && <p className="dim">{t('watch.empty')}</p>}
      <ul className="watch">
        {shown.map((row) => (
          <Watched
            key={row.key}
            drive={drive}
            row={row}
            onRemove={() => void keep(watch.filter((key) => key !== row.key))}
          />
        ))}
      </ul>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </Panel>
  )
}

function Watched({
  drive,
  row,
  onRemove,
}: {
  drive: string
  row: ParameterRow
  onRemove: () => void
}) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const [now, setNow] = useState(serverNow)
  useEffect(() => {
    const timer = setInterval(() => setNow(serverNow()), 1000)
    return () => clearInterval(timer)
  }, [])
  const age = reading.time === null ? null : Math.max(0, now - Date.parse(reading.time))
  const old = age === null || age > FRESH_MS
  return (
    <li className={old ? 'stale' : ''}>
      <span className="grow">
        {row.name} <small className="dim mono">{row.number ?? row.key}</small>
        {reading.error && (
          <small className="fault-text">
            {' '}
            <Said message={reading.error_message} words={reading.error} />
          </small>
        )}
      </span>
      <strong className="num">
        {readingText(row, reading, false)} <span className="unit">{row.unit}</span>
      </strong>
      {old && age !== null && (
        <small className="dim num">{t('watch.age', { time: duration(age / 1000) })}</small>
      )}
      <ActionIcon aria-label={t('watch.remove', { name: row.name })} onClick={onRemove}>
        <Icon name="cross" />
      </ActionIcon>
    </li>
  )
}
