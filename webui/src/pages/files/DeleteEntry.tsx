import { Button, Modal } from '@mantine/core'
import { api, ask } from '../../api/client'
import type { LibraryEntry } from '../../api/schema'
import { useT } from '../../i18n'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useAction } from '../../widgets/useAction'

/** Sets are put aside and can be taken back; a file of the station is gone for good. */
export function DeleteEntry({
  entry,
  onClose,
  onDeleted,
}: {
  entry: LibraryEntry
  onClose: () => void
  onDeleted: () => void
}) {
  const t = useT()
  const act = useAction()
  const forGood = entry.station !== ''
  const remove = async () => {
    const done = await act.run(() =>
      ask(api.DELETE('/api/v1/library/{entry_id}', { params: { path: { entry_id: entry.id } } })),
    )
    if (!done) return
    onClose()
    onDeleted()
  }
  return (
    <Modal
      opened
      onClose={onClose}
      title={t(forGood ? 'library.delete' : 'library.putAside', { name: entry.name })}
    >
      <p>{t(forGood ? 'library.deleteText' : 'library.putAsideText')}</p>
      <ProblemNote problem={act.problem} />
      <div className="row end">
        <Button onClick={onClose}>{t('cancel')}</Button>
        <Button color="red" variant="filled" loading={act.busy} onClick={() => void remove()}>
          {t(forGood ? 'library.deleteNow' : 'library.putAsideNow')}
        </Button>
      </div>
    </Modal>
  )
}
