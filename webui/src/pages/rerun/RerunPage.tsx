import { Button, TextInput } from '@mantine/core'
import { useState } from 'react'
import { useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { BundlesPanel } from './BundlesPanel'
import { RecordForm } from './RecordForm'
import { RecordingRow } from './RecordingRow'
import { RetentionPanel } from './RetentionPanel'
import './rerun.css'
import { useRecordings } from './useRecordings'
import { Viewer } from './Viewer'
import { size } from './viewer'

/** Recordings: make, find, export, and look at them, or at what happens now, in rerun. */
export function RerunPage() {
  const t = useT()
  const [search, setSearch] = useState('')
  const { list, problem, refresh } = useRecordings(search)
  // undefined: closed, null: live, else the name of a recording
  const [shown, setShown] = useState<string | null | undefined>(undefined)
  return (
    <div className="page">
      <h1>{t('page.rerun')}</h1>
      <RecordForm onStarted={() => void refresh()} />
      <Panel
        title={t('page.rerun')}
        tools={list && <span>{t('recordings.free', { size: size(list.free_bytes) })}</span>}
      >
        <TextInput
          label={t('recordings.search')}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
        />
        <ProblemNote problem={problem} />
        {list && (
          <RetentionPanel
            key={JSON.stringify(list.retention)}
            list={list}
            onChanged={() => void refresh()}
          />
        )}
        {list?.recordings.length === 0 && <p className="dim">{t('recordings.none')}</p>}
        {list?.recordings.map((each) => (
          <RecordingRow
            key={each.name}
            recording={each}
            onOpen={() => setShown(each.name)}
            onChanged={() => void refresh()}
          />
        ))}
      </Panel>
      <BundlesPanel />
      <Panel
        title={t('rerun.title')}
        tools={
          <>
            <Button onClick={() => setShown(null)}>{t('rerun.live')}</Button>
            {shown !== undefined && (
              <Button onClick={() => setShown(undefined)}>{t('rerun.close')}</Button>
            )}
          </>
        }
      >
        {shown === undefined ? (
          <p className="dim">{t('rerun.help')}</p>
        ) : (
          <Viewer recording={shown} />
        )}
      </Panel>
    </div>
  )
}
