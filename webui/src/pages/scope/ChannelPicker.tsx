import { Button, Checkbox, Modal, NativeSelect, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useT } from '../../i18n'
import { loadRows } from '../../live/live'
import { contents, useDrives, useRows } from '../../live/store'
import { matches } from '../parameters/filters'
import { type Channel, drawable, GREATEST_CHANNELS } from './channels'

const GREATEST_LIST = 120

/** Choose traces from any axis. */
export function ChannelPicker({
  channels,
  onChange,
  onClose,
}: {
  channels: Channel[]
  onChange: (channels: Channel[]) => void
  onClose: () => void
}) {
  const t = useT()
  const drives = useDrives() ?? []
  const [drive, setDrive] = useState(channels[0]?.drive ?? drives[0]?.id ?? '')
  const [search, setSearch] = useState('')
  const rows = useRows(drive)
  useEffect(() => {
    if (drive && !contents.rows.has(drive)) void loadRows(drive).catch(() => {})
  }, [drive])
  const has = (key: string) => channels.some((each) => each.drive === drive && each.key === key)
  const found = (rows ?? []).filter((row) => drawable(row) && matches(row, search))
  // Chosen ones first, then what the drive itself offers for cyclic exchange.
  const ordered = found.sort(
    (x, y) =>
      Number(has(y.key)) - Number(has(x.key)) ||
      Number(y.pdo !== 'none') - Number(x.pdo !== 'none'),
  )
  const toggle = (key: string) =>
    onChange(
      has(key)
        ? channels.filter((each) => each.drive !== drive || each.key !== key)
        : [...channels, { drive, key }],
    )
  return (
    <Modal opened onClose={onClose} title={t('scope.choose')} size="lg">
      <div className="row">
        <NativeSelect
          label={t('frame.axis')}
          value={drive}
          onChange={(event) => setDrive(event.currentTarget.value)}
          data={drives.map((each) => ({ value: each.id, label: each.name }))}
        />
        <TextInput
          className="grow"
          label={t('parameters.search')}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
        />
      </div>
      {channels.length >= GREATEST_CHANNELS && (
        <p className="warn-text">{t('scope.full', { count: GREATEST_CHANNELS })}</p>
      )}
      <div className="scroll-list tall">
        {ordered.slice(0, GREATEST_LIST).map((row) => (
          <Checkbox
            key={row.key}
            checked={has(row.key)}
            disabled={!has(row.key) && channels.length >= GREATEST_CHANNELS}
            onChange={() => toggle(row.key)}
            label={`${row.number ?? row.key} ${row.name}${row.unit ? ` [${row.unit}]` : ''}`}
          />
        ))}
        {ordered.length > GREATEST_LIST && (
          <p className="dim">{t('scope.more', { count: ordered.length - GREATEST_LIST })}</p>
        )}
      </div>
      <div className="row end">
        <Button variant="filled" onClick={onClose}>
          {t('close')}
        </Button>
      </div>
    </Modal>
  )
}
