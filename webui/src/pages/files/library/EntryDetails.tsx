import { Button, TagsInput, Textarea } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { LibraryEntry, VersionInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { dateTime } from '../../../widgets/numbers/format'
import { ChangedMeanwhile } from '../../../widgets/messages/ChangedMeanwhile'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { useRemarks } from '../../../widgets/requests/useRemarks'
import { contentUrl } from './LibraryRow'

/** Folded away: all versions of an entry, its tags and its notes. */
export function EntryDetails({
  entry,
  onCompare,
  onChanged,
}: {
  entry: LibraryEntry
  onCompare: (version: number) => void
  onChanged: () => void
}) {
  const t = useT()
  const [open, setOpen] = useState(false)
  return (
    <details className="remarks" onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>{t(entry.kind === 'set' ? 'library.details' : 'library.remarks')}</summary>
      {open && (
        <>
          {entry.versions > 1 && <Versions entry={entry} onCompare={onCompare} />}
          <Remarks entry={entry} onChanged={onChanged} />
        </>
      )}
    </details>
  )
}

function Versions({
  entry,
  onCompare,
}: {
  entry: LibraryEntry
  onCompare: (version: number) => void
}) {
  const t = useT()
  const { problem, run } = useAction()
  const [versions, setVersions] = useState<VersionInfo[]>([])
  useEffect(() => {
    void run(async () => {
      const path = { entry_id: entry.id }
      setVersions(await ask(api.GET('/api/v1/library/{entry_id}/versions', { params: { path } })))
    })
  }, [entry.id, entry.versions, run])
  return (
    <div className="scroll-table">
      <ProblemNote problem={problem} />
      <table>
        <thead>
          <tr>
            <th>{t('library.column.version')}</th>
            <th>{t('library.column.saved')}</th>
            <th>{t('library.column.author')}</th>
            <th>{t('library.column.axis')}</th>
            <th>{t('library.column.notes')}</th>
            <th />
          </tr>
        </thead>
        <tbody>
          {versions.map((version) => (
            <tr key={version.number}>
              <td className="num">{version.number}</td>
              <td>{dateTime(version.saved)}</td>
              <td>{version.author}</td>
              <td>
                {version.axis.name}
                {version.axis.serial !== null && ` · ${version.axis.serial}`}
              </td>
              <td className="notes">{version.notes}</td>
              <td>
                <div className="row end">
                  {entry.kind === 'set' && (
                    <Button
                      aria-label={t('library.compareVersion', { number: version.number })}
                      onClick={() => onCompare(version.number)}
                    >
                      {t('library.compare')}
                    </Button>
                  )}
                  <Button
                    component="a"
                    href={contentUrl(entry, version.number)}
                    download={entry.name}
                    aria-label={t('library.downloadVersion', { number: version.number })}
                  >
                    {t('sets.download')}
                  </Button>
                </div>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}

function Remarks({ entry, onChanged }: { entry: LibraryEntry; onChanged: () => void }) {
  const t = useT()
  const remarks = useRemarks(entry, (change) =>
    ask(
      api.PATCH('/api/v1/library/{entry_id}', {
        params: { path: { entry_id: entry.id } },
        body: change,
      }),
    ),
  )
  const done = (saved: boolean) => saved && onChanged()
  return (
    <>
      <TagsInput
        label={t('library.tags')}
        value={remarks.tags}
        maxTags={20}
        onChange={(next) => remarks.change({ tags: next.map((tag) => tag.slice(0, 60)) })}
      />
      <Textarea
        label={t('library.notes')}
        value={remarks.notes}
        maxLength={4000}
        autosize
        onChange={(event) => remarks.change({ notes: event.currentTarget.value })}
      />
      <ChangedMeanwhile
        problem={remarks.act.problem}
        mine={remarks}
        busy={remarks.act.busy}
        onTake={remarks.take}
        onOverwrite={(field, theirs) => void remarks.overwrite(field, theirs).then(done)}
        onClose={remarks.act.clear}
      />
      <div className="row end">
        <Button loading={remarks.act.busy} onClick={() => void remarks.save().then(done)}>
          {t('library.saveRemarks')}
        </Button>
      </div>
    </>
  )
}
