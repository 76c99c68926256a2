import { useEffect } from 'react'
import type { ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { useDrive, useLink, useReading, useRows } from '../../live/store'
import { clock, hexadecimal } from '../../widgets/format'
import { DIGITAL_INPUTS, DIGITAL_OUTPUTS } from '../../widgets/objects'
import { Panel } from '../../widgets/Panel'
import { bitFields, getField } from '../../widgets/parse'

const PERIOD_S = 0.1

/** Digital inputs and outputs as the drive reports them (60FDh, 60FEh). */
export function IoPage({ drive }: { drive: string }) {
  const t = useT()
  const rows = useRows(drive)
  const summary = useDrive(drive)
  const { open } = useLink()
  const shown = (rows ?? []).filter(
    (row) => row.reachable && (row.key === DIGITAL_INPUTS || row.key === DIGITAL_OUTPUTS),
  )
  const keys = shown.map((row) => row.key).join(' ')
  useEffect(() => {
    if (open && rows === null) void live.loadRows(drive).catch(() => {})
  }, [drive, open, rows])
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
  return (
    <div className="page">
      <h1>
        {t('page.io')} <small className="dim">{summary?.name}</small>
      </h1>
      <div className="columns">
        {shown.map((row) => (
          <Bits key={row.key} drive={drive} row={row} />
        ))}
      </div>
      {rows && shown.length === 0 && <p className="empty">{t('io.none')}</p>}
    </div>
  )
}

function Bits({ drive, row }: { drive: string; row: ParameterRow }) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const raw = typeof reading.raw === 'number' ? reading.raw : null
  const fields = bitFields(row)
  return (
    <Panel title={row.name}>
      <p className="dim mono">
        {row.key} {raw !== null && hexadecimal(raw, row.type)}{' '}
        {t('io.at', { time: clock(reading.time) })}
      </p>
      {reading.error && <p className="note fault">{reading.error}</p>}
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
