import { Button, Modal, NativeSelect } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { FoundDrive, ImportedDescription, ProfileInfo } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { useLink } from '../../../live/store'
import { Icon } from '../../../widgets/layout/Icon'
import { Panel } from '../../../widgets/layout/Panel'
import { ImportForm } from './ImportForm'
import { ProfileExport } from './ProfileExport'

/** Offered where no profile fits a found drive for certain. */
export function NotListedButton({
  found,
  onMade,
}: {
  found: FoundDrive
  onMade: (made: ImportedDescription) => void
}) {
  const t = useT()
  const [open, setOpen] = useState(false)
  return (
    <>
      <Button leftSection={<Icon name="upload" />} onClick={() => setOpen(true)}>
        {t('notListed.open')}
      </Button>
      {open && (
        <Modal opened size="lg" onClose={() => setOpen(false)} title={t('notListed.title')}>
          <ImportForm found={found} onMade={onMade} />
        </Modal>
      )}
    </>
  )
}

/** Import without a drive at hand, and export of what there is. */
export function NotListedPanel() {
  const t = useT()
  const say = useSay()
  const { open } = useLink()
  const [profiles, setProfiles] = useState<ProfileInfo[]>([])
  const [chosen, setChosen] = useState('')
  const refresh = useCallback(() => {
    ask(api.GET('/api/v1/profiles')).then(setProfiles, () => {})
  }, [])
  useEffect(() => {
    if (open) refresh()
  }, [open, refresh])
  const profile = profiles.find((each) => each.profile === chosen) ?? profiles[0]
  const broken = say.message(profile?.problem_message, profile?.problem)
  return (
    <Panel title={t('notListed.title')}>
      <details>
        <summary>{t('notListed.import')}</summary>
        <ImportForm onMade={refresh} />
      </details>
      <details>
        <summary>{t('notListed.export')}</summary>
        <div className="row">
          <NativeSelect
            className="grow"
            label={t('connect.profile')}
            value={profile?.profile ?? ''}
            onChange={(event) => setChosen(event.currentTarget.value)}
            data={profiles.map((each) => ({ value: each.profile, label: each.title }))}
          />
        </div>
        {broken !== '' && <p className="warn-text">{t('notListed.broken', { problem: broken })}</p>}
        {profile && broken === '' && <ProfileExport key={profile.profile} {...profile} />}
      </details>
    </Panel>
  )
}
