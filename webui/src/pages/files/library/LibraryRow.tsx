import { ActionIcon, Button } from '@mantine/core'
import { useState } from 'react'
import { API_ROOT, api, ask } from '../../../api/client'
import type { LibraryEntry } from '../../../api/schema'
import { type T, useT } from '../../../i18n'
import { dateTime, duration } from '../../../widgets/numbers/format'
import { Icon } from '../../../widgets/layout/Icon'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { Said } from '../../../widgets/messages/Said'
import { useAction } from '../../../widgets/requests/useAction'
import { size } from '../../rerun/viewer'
import { DeleteEntry } from './DeleteEntry'
import { EntryDetails } from './EntryDetails'
import { useListDownload } from './ListDownload'

export function contentUrl(entry: LibraryEntry, version?: number): string {
  const query = version === undefined ? '' : `?version=${version}`
  return `${API_ROOT}/api/v1/library/${entry.id}/content${query}`
}

/** What an entry is, in one line. */
function factsOf(t: T, entry: LibraryEntry): string {
  const { latest } = entry
  const fact = (name: string) => latest.facts[name]
  const seconds = fact('duration_s')
  return [
    latest.axis.name,
    latest.axis.profile,
    latest.axis.serial !== null && `${t('identity.serial')} ${latest.axis.serial}`,
    latest.axis.firmware && `${t('identity.firmware')} ${latest.axis.firmware}`,
    fact('parameters') !== undefined &&
      t('library.parameters', { count: String(fact('parameters')) }),
    fact('channels') !== undefined && t('library.channels', { count: String(fact('channels')) }),
    typeof seconds === 'number' && duration(seconds),
    fact('measurement'),
    size(latest.bytes),
    dateTime(latest.saved),
    latest.author,
    entry.station && !entry.here && t('library.elsewhere', { station: entry.station }),
  ]
    .filter(Boolean)
    .join(' · ')
}

/** One entry of the library. */
export function LibraryRow({
  entry,
  shared,
  onCompare,
  onHandOver,
  onChanged,
}: {
  entry: LibraryEntry
  /** Other stations may have the same library. */
  shared: boolean
  onCompare: (entry: LibraryEntry, version?: number) => void
  onHandOver: (entry: LibraryEntry) => void
  onChanged: () => void
}) {
  const t = useT()
  const act = useAction()
  const lists = useListDownload(entry.name)
  const [deleting, setDeleting] = useState(false)
  const problem = entry.latest.facts.problem
  const { name } = entry
  // Shared contents are everybody's to download; to be opened they lie in the station's folder.
  const opens = entry.kind === 'recording' || entry.kind === 'measurement'
  const path = { params: { path: { entry_id: entry.id } } }
  const copy = (to: 'share' | 'fetch') =>
    act
      .run(() =>
        ask(
          to === 'share'
            ? api.POST('/api/v1/library/{entry_id}/share', path)
            : api.POST('/api/v1/library/{entry_id}/fetch', path),
        ),
      )
      .then((done) => done && onChanged())
  const takeBack = () =>
    act
      .run(() =>
        ask(
          api.PATCH('/api/v1/library/{entry_id}', {
            params: { path: { entry_id: entry.id } },
            body: { deleted: false },
          }),
        ),
      )
      .then(onChanged)
  return (
    <article className="set library-row" aria-label={name}>
      <div className="library-head">
        <div className="grow">
          <p className="library-name">
            <span className="library-kind">{t(`library.kind.${entry.kind}`)}</span>
            <strong>{name}</strong>
            {entry.versions > 1 && (
              <span className="mark quiet">
                {t('library.version', { number: entry.latest.number })}
              </span>
            )}
            {entry.tags.map((tag) => (
              <span className="library-tag" key={tag}>
                {tag}
              </span>
            ))}
          </p>
          <p className="dim">{factsOf(t, entry)}</p>
          {typeof problem === 'string' && (
            <p className="warn-text">
              <Said message={entry.latest.problem_message} words={problem} />
            </p>
          )}
          {[entry.latest.notes, entry.notes].filter(Boolean).map((notes) => (
            <p className="notes" key={notes}>
              {notes}
            </p>
          ))}
        </div>
        <div className="library-tools">
          {entry.deleted !== null ? (
            <Button
              loading={act.busy}
              aria-label={t('library.takeBackNamed', { name })}
              onClick={() => void takeBack()}
            >
              {t('library.takeBack')}
            </Button>
          ) : (
            <>
              {entry.kind === 'set' && (
                <Button
                  aria-label={t('library.compareNamed', { name })}
                  onClick={() => onCompare(entry)}
                >
                  {t('library.compare')}
                </Button>
              )}
              {entry.kind === 'set' && (
                <Button
                  aria-label={t('handover.openNamed', { name })}
                  onClick={() => onHandOver(entry)}
                >
                  {t('handover.open')}
                </Button>
              )}
              {shared && entry.kind !== 'set' && entry.here && entry.station && (
                <Button
                  loading={act.busy}
                  aria-label={t('library.shareNamed', { name })}
                  onClick={() => void copy('share')}
                >
                  {t('library.share')}
                </Button>
              )}
              {opens && !entry.station && (
                <Button
                  loading={act.busy}
                  aria-label={t('library.fetchNamed', { name })}
                  onClick={() => void copy('fetch')}
                >
                  {t('library.fetch')}
                </Button>
              )}
              {entry.here && (
                <ActionIcon
                  component="a"
                  href={contentUrl(entry)}
                  download={name}
                  aria-label={t('library.download', { name })}
                >
                  <Icon name="download" />
                </ActionIcon>
              )}
              {entry.kind === 'set' && lists.buttons}
              {entry.here && (
                <ActionIcon
                  aria-label={t(entry.station ? 'library.delete' : 'library.putAside', { name })}
                  onClick={() => setDeleting(true)}
                >
                  <Icon name="cross" />
                </ActionIcon>
              )}
            </>
          )}
        </div>
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {entry.kind === 'set' && lists.note}
      {entry.deleted === null && (
        <EntryDetails
          entry={entry}
          onCompare={(version) => onCompare(entry, version)}
          onChanged={onChanged}
        />
      )}
      {deleting && (
        <DeleteEntry entry={entry} onClose={() => setDeleting(false)} onDeleted={onChanged} />
      )}
    </article>
  )
}
