import { Button } from '@mantine/core'
import { useState } from 'react'
import type { LibraryEntry } from '../../api/schema'
import { useRoute } from '../../app/navigation/router'
import { useT } from '../../i18n'
import { useDrive, useDrives } from '../../live/store'
import { Panel } from '../../widgets/layout/Panel'
import { Said } from '../../widgets/messages/Said'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import './files.css'
import { type Filters, NO_FILTERS } from './library/filters'
import { HandOver } from './handover/HandOver'
import { LibraryFilters } from './library/LibraryFilters'
import { LibraryRow } from './library/LibraryRow'
import { SaveSet, UploadSet } from './sets/SetActions'
import { SetComparison, type Side } from './sets/SetComparison'
import { useLibrary } from './library/useLibrary'

/** Everything that is stored: parameter sets with their versions, recordings, measurements, reports. */
export function FilesPage() {
  const t = useT()
  const [filters, setFilters] = useState<Filters>(NO_FILTERS)
  const { entries, total, tags, problems, messages, shared, problem, refresh, more } =
    useLibrary(filters)
  const drives = useDrives() ?? []
  const { drive: chosen } = useRoute()
  const drive = useDrive(chosen ?? drives[0]?.id ?? null)
  const [comparing, setComparing] = useState<Side | null>(null)
  const changed = () => void refresh()
  const [handing, setHanding] = useState<LibraryEntry | null>(null)
  const handOver = (entry: LibraryEntry) => {
    setHanding(entry)
    setComparing(null)
    toTop()
  }
  const compare = (entry: LibraryEntry, version?: number) => {
    setComparing({ entry, version: version ?? null })
    setHanding(null)
    toTop()
  }
  return (
    <div className="page">
      <h1>{t('page.files')}</h1>
      {comparing && (
        <SetComparison
          key={`${comparing.entry.id} ${comparing.version}`}
          theirs={comparing}
          onClose={() => setComparing(null)}
          onChanged={changed}
        />
      )}
      {handing && <HandOver key={handing.id} entry={handing} onClose={() => setHanding(null)} />}
      <Panel
        title={t('library.title')}
        tools={
          <>
            {drive && <SaveSet drive={drive} onSaved={changed} />}
            <UploadSet drive={drive} onStored={changed} />
          </>
        }
      >
        <LibraryFilters filters={filters} tags={tags} onChange={setFilters} />
        <ProblemNote problem={problem} />
        {problems.length > 0 && (
          <div className="note warn">
            <p>{t('library.problems')}</p>
            <ul>
              {problems.map((text, n) => (
                <li key={text}>
                  <Said message={messages[n]} words={text} />
                </li>
              ))}
            </ul>
          </div>
        )}
        {entries?.length === 0 && (
          <p className="empty">{t(filters === NO_FILTERS ? 'library.empty' : 'library.none')}</p>
        )}
        {entries?.map((entry) => (
          <LibraryRow
            key={entry.id}
            entry={entry}
            shared={shared}
            onCompare={compare}
            onHandOver={handOver}
            onChanged={changed}
          />
        ))}
        {entries && total > 0 && (
          <div className="row wrap middle">
            <span className="dim grow">{t('library.count', { shown: entries.length, total })}</span>
            {entries.length < total && <Button onClick={more}>{t('library.more')}</Button>}
          </div>
        )}
      </Panel>
    </div>
  )
}

function toTop(): void {
  window.scrollTo({ top: 0 })
  document.getElementById('main')?.scrollTo({ top: 0 })
}
