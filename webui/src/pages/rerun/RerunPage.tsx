import { Button, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { POSITION_ACTUAL, TORQUE_ACTUAL, VELOCITY_ACTUAL } from '../../widgets/objects'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useAction } from '../../widgets/useAction'
import { storedChannels } from '../scope/channels'
import { RecordingRow } from './RecordingRow'
import { useRecordings } from './useRecordings'
import { Viewer } from './Viewer'
import { size } from './viewer'

/** Recordings: make, find, export, and look at them, or at what happens now, in rerun. */
export function RerunPage() {
  const t = useT()
  const [search, setSearch] = useState('')
  const [name, setName] = useState('')
  const [notes, setNotes] = useState('')
  const { list, problem, refresh } = useRecordings(search)
  // undefined: closed, null: live, else the name of a recording
  const [shown, setShown] = useState<string | null | undefined>(undefined)
  const act = useAction()
  const channels = useChannels()
  const start = () =>
    act.run(async () => {
      await ask(
        api.POST('/api/v1/recordings', {
          body: { name, notes, channels, period_s: 0, pre_s: 0, tags: [] },
        }),
      )
      setName('')
      setNotes('')
      await refresh()
    })
  return (
    <div className="page">
      <h1>{t('page.rerun')}</h1>
      <Panel title={t('recordings.start')}>
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <p className="dim">{t('recordings.what', { count: channels.length })}</p>
        <div className="row">
          <TextInput
            label={t('recordings.name')}
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
          />
          <TextInput
            className="grow"
            label={t('recordings.notes')}
            value={notes}
            onChange={(event) => setNotes(event.currentTarget.value)}
          />
          <Button
            variant="filled"
            loading={act.busy}
            disabled={channels.length === 0}
            onClick={() => void start()}
          >
            {t('recordings.start')}
          </Button>
        </div>
      </Panel>
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

/** What the Scope page shows, or position, speed and torque of every axis. */
function useChannels() {
  const drives = useDrives() ?? []
  const known = new Set(drives.map((each) => each.id))
  const chosen = (storedChannels() ?? []).filter((each) => known.has(each.drive))
  if (chosen.length > 0) return chosen
  return drives.flatMap(({ id }) =>
    [POSITION_ACTUAL, VELOCITY_ACTUAL, TORQUE_ACTUAL].map((key) => ({ drive: id, key })),
  )
}
