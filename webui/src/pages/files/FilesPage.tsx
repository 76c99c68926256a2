import { ActionIcon, Button, Modal } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { SetFileInfo } from '../../api/schema'
import { useRoute } from '../../app/router'
import { useT } from '../../i18n'
import { useDrive, useDrives } from '../../live/store'
import { dateTime } from '../../widgets/format'
import { Icon } from '../../widgets/Icon'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useAction } from '../../widgets/useAction'
import { SaveSet, UploadSet } from './SetActions'
import { listUrl, offerDownload, useSets } from './sets'

/** Parameter sets kept by the server. */
export function FilesPage() {
  const t = useT()
  const { sets, refresh, problem } = useSets()
  const drives = useDrives() ?? []
  const { drive: chosen } = useRoute()
  const drive = useDrive(chosen ?? drives[0]?.id ?? null)
  const act = useAction()
  const [deleting, setDeleting] = useState<SetFileInfo | null>(null)
  const download = (file: string) =>
    act.run(async () => {
      const text = await ask(
        api.GET('/api/v1/sets/{file}', { params: { path: { file } }, parseAs: 'text' }),
      )
      offerDownload(file, [text], 'application/toml')
    })
  return (
    <div className="page">
      <h1>{t('page.files')}</h1>
      <Panel
        title={t('sets.title')}
        tools={
          <>
            {drive && <SaveSet drive={drive} onSaved={refresh} />}
            <UploadSet drive={drive} onStored={() => void refresh()} />
          </>
        }
      >
        <ProblemNote problem={problem ?? act.problem} onClose={act.clear} />
        {sets.length === 0 && <p className="dim">{t('sets.none')}</p>}
        {sets.map((set) => (
          <article key={set.file} className="set">
            <div className="grow">
              <strong>{set.file}</strong>
              {set.problem ? (
                <p className="warn-text">{set.problem}</p>
              ) : (
                <p className="dim">
                  {[
                    set.profile,
                    set.drive_name,
                    set.serial !== null && `${t('identity.serial')} ${set.serial}`,
                    set.firmware && `${t('identity.firmware')} ${set.firmware}`,
                    t('sets.count', { count: set.count }),
                    dateTime(set.saved),
                    set.author,
                  ]
                    .filter(Boolean)
                    .join(' · ')}
                </p>
              )}
              {set.notes && <p className="notes">{set.notes}</p>}
            </div>
            <Button leftSection={<Icon name="download" />} onClick={() => void download(set.file)}>
              {t('sets.download')}
            </Button>
            {!set.problem &&
              (['csv', 'dcf'] as const).map((format) => (
                <Button
                  key={format}
                  component="a"
                  href={listUrl(set.file, format)}
                  download
                  aria-label={t('sets.exportAs', { name: set.file, format: format.toUpperCase() })}
                >
                  {format.toUpperCase()}
                </Button>
              ))}
            <ActionIcon
              aria-label={t('sets.delete', { name: set.file })}
              onClick={() => setDeleting(set)}
            >
              <Icon name="cross" />
            </ActionIcon>
          </article>
        ))}
        <p className="dim">{t('sets.loadHelp')}</p>
      </Panel>
      {deleting && (
        <Modal
          opened
          onClose={() => setDeleting(null)}
          title={t('sets.delete', { name: deleting.file })}
        >
          <p>{t('sets.deleteText')}</p>
          <div className="row end">
            <Button onClick={() => setDeleting(null)}>{t('cancel')}</Button>
            <Button
              color="red"
              variant="filled"
              loading={act.busy}
              onClick={async () => {
                await act.run(() =>
                  ask(
                    api.DELETE('/api/v1/sets/{file}', {
                      params: { path: { file: deleting.file } },
                    }),
                  ),
                )
                setDeleting(null)
                void refresh()
              }}
            >
              {t('sets.deleteNow')}
            </Button>
          </div>
        </Modal>
      )}
    </div>
  )
}
