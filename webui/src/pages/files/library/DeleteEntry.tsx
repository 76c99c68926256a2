import { api, ask } from '../../../api/client'
import type { LibraryEntry } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ConfirmDelete } from '../../../widgets/messages/ConfirmDelete'
import { useAction } from '../../../widgets/requests/useAction'

/** Sets are archived and can be restored; a file of the station is gone for good. */
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
    <ConfirmDelete
      title={t(forGood ? 'library.delete' : 'library.putAside', { name: entry.name })}
      action={t(forGood ? 'library.deleteNow' : 'library.putAsideNow')}
      busy={act.busy}
      problem={act.problem}
      onClose={onClose}
      onDelete={() => void remove()}
    >
      <p>{t(forGood ? 'library.deleteText' : 'library.putAsideText')}</p>
    </ConfirmDelete>
  )
}
