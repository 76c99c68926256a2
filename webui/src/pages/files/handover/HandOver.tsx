import { Button, NativeSelect } from '@mantine/core'
import { useState } from 'react'
import type { LibraryEntry } from '../../../api/schema'
import { useRoute } from '../../../app/navigation/router'
import { useT } from '../../../i18n'
import { useDrives } from '../../../live/store'
import { Panel } from '../../../widgets/layout/Panel'
import { ControllerList } from './ControllerList'
import { EarlierHandovers } from './EarlierHandovers'
import { HandOverExport } from './HandOverExport'

/** A set for the machine's controller: its start-up list, and what the controller's list undoes. */
export function HandOver({ entry, onClose }: { entry: LibraryEntry; onClose: () => void }) {
  const t = useT()
  const family = entry.latest.axis.profile
  const drives = (useDrives() ?? []).filter((each) => each.profile === family)
  const { drive: chosen } = useRoute()
  const [axis, setAxis] = useState(
    drives.some((each) => each.id === chosen) ? chosen : (drives[0]?.id ?? null),
  )
  const [made, setMade] = useState(0)
  const drive = drives.find((each) => each.id === axis) ?? null
  return (
    <Panel
      title={`${t('handover.title')}: ${entry.name}`}
      tools={<Button onClick={onClose}>{t('close')}</Button>}
    >
      <p className="dim">{t('handover.lead')}</p>
      <NativeSelect
        label={t('three.axis')}
        value={axis ?? ''}
        onChange={(event) => setAxis(event.currentTarget.value)}
        data={drives.map((each) => ({ value: each.id, label: each.name }))}
      />
      {drive === null ? (
        <p className="empty">{t('three.noAxis')}</p>
      ) : (
        <>
          <HandOverExport
            key={drive.id}
            drive={drive}
            entry={entry}
            onMade={() => setMade(made + 1)}
          />
          <ControllerList key={drive.id} drive={drive} file={entry.name} />
          <EarlierHandovers key={`${drive.id} ${made}`} drive={drive} />
        </>
      )}
    </Panel>
  )
}
