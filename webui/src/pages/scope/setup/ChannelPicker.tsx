import { Button, Checkbox, Modal, NativeSelect, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useT } from '../../../i18n'
import { loadRows } from '../../../live/live'
import { contents, useDrives } from '../../../live/store'
import { matches } from '../../parameters/filters'
import type { ScopeSetup } from '../../../api/schema'
import { useRows } from '../../../widgets/profile-text/rows'
import { type Channel, drawable } from './channels'
import { GREATEST_CHANNELS, withChannels } from './setup'
import { UnitRows } from './UnitRows'
import { useScopeChannels } from '../useScope'

const GREATEST_LIST = 120

/** Choose traces from any axis, and the units in which they are shown. */
export function ChannelPicker({
  setup,
  onChange,
  onClose,
}: {
  setup: ScopeSetup
  onChange: (setup: ScopeSetup) => void
  onClose: () => void
}) {
  const t = useT()
  const infos = useScopeChannels()
  const channels: Channel[] = setup.traces.map(({ drive, key }) => ({ drive, key }))
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
      withChannels(
        setup,
        has(key)
          ? channels.filter((each) => each.drive !== drive || each.key !== key)
          : [...channels, { drive, key }],
      ),
    )
  const nameOf = (channel: Channel) => {
    const owner = drives.find((each) => each.id === channel.drive)?.name ?? channel.drive
    return `${owner} ${infos.get(`${channel.drive} ${channel.key}`)?.name ?? channel.key}`
  }
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
      {setup.traces.length > 0 && (
        <details className="units">
          <summary>{t('scope.units')}</summary>
          <UnitRows
            traces={setup.traces}
            infos={infos}
            nameOf={nameOf}
            onChange={(traces) => onChange({ ...setup, traces })}
          />
        </details>
      )}
      <div className="row end">
        <Button variant="filled" onClick={onClose}>
          {t('close')}
        </Button>
      </div>
    </Modal>
  )
}
