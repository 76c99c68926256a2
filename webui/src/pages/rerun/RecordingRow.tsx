import { ActionIcon, Button } from '@mantine/core'
import { useState } from 'react'
import { api, API_ROOT, ask } from '../../api/client'
import type { JobInfo, RecordingInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { ConfirmDelete } from '../../widgets/messages/ConfirmDelete'
import { dateTime, duration } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { JobNote, useJobEnd } from '../../widgets/jobs/JobNote'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { Said } from '../../widgets/messages/Said'
import { useAction } from '../../widgets/requests/useAction'
import { Remarks } from './Remarks'
import { size } from './viewer'

type Kind = 'csv' | 'csv_raw' | 'rrd' | 'mcap'

const KINDS: Record<Kind, string> = { csv: 'CSV', csv_raw: '', rrd: 'RRD', mcap: 'MCAP' }

/** One recording: what it is, end, open, export, delete. */
export function RecordingRow({
  recording,
  onOpen,
  onChanged,
}: {
  recording: RecordingInfo
  onOpen: () => void
  onChanged: () => void
}) {
  const t = useT()
  const act = useAction()
  const { name } = recording
  const running = recording.state === 'recording' || recording.state === 'waiting'
  const [deleting, setDeleting] = useState(false)
  const [job, setJob] = useState<{ id: string; kind: Kind; open: boolean } | null>(null)
  const path = { params: { path: { name } } }
  useJobEnd(job?.id ?? null, (ended: JobInfo) => {
    if (ended.state !== 'done' || job === null) return
    onChanged()
    if (job.open) onOpen()
    else fetchFile(name, job.kind)
  })
  const need = (kind: Kind, open: boolean) =>
    act.run(async () => {
      if (recording.exports.includes(kind)) {
        if (open) onOpen()
        else fetchFile(name, kind)
        return
      }
      const started = await ask(
        api.POST('/api/v1/recordings/{name}/exports/{kind}', {
          params: { path: { name, kind } },
        }),
      )
      setJob({ id: started.id, kind, open })
    })
  return (
    <article className="set">
      <div className="grow">
        <strong>{name}</strong>
        <p className={recording.problem ? 'warn-text' : 'dim'}>
          {t(`recordings.state.${recording.state}`)} · {dateTime(recording.created)} ·{' '}
          {t('recordings.facts', {
            duration: duration(recording.duration_s),
            samples: recording.samples,
            size: size(recording.bytes),
          })}
          {recording.lost > 0 && ` · ${t('recordings.lost', { count: recording.lost })}`}{' '}
          <Said message={recording.problem_message} words={recording.problem} />
        </p>
        {(recording.kept || recording.tags.length > 0) && (
          <p>
            {recording.kept && <span className="tag">{t('recordings.kept')}</span>}{' '}
            {recording.tags.map((each) => (
              <span className="tag" key={each}>
                {each}
              </span>
            ))}
          </p>
        )}
        {recording.notes && <p className="notes">{recording.notes}</p>}
        {!running && recording.state !== 'unusable' && (
          <Remarks recording={recording} onChanged={onChanged} />
        )}
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <JobNote id={job?.id ?? null} onClose={() => setJob(null)} />
      </div>
      {recording.state === 'waiting' && (
        <Button
          onClick={() =>
            void act
              .run(() => ask(api.POST('/api/v1/recordings/{name}/trigger', path)))
              .then(onChanged)
          }
        >
          {t('recordings.beginNow')}
        </Button>
      )}
      {running ? (
        <Button
          loading={act.busy}
          onClick={() =>
            void act
              .run(() => ask(api.POST('/api/v1/recordings/{name}/stop', path)))
              .then(onChanged)
          }
        >
          {t('recordings.stop')}
        </Button>
      ) : (
        recording.state !== 'unusable' && (
          <>
            <Button onClick={() => void need('rrd', true)}>{t('recordings.open')}</Button>
            {(Object.keys(KINDS) as Kind[]).map((kind) => {
              const label = KINDS[kind] || t('recordings.csvRaw')
              return (
                <Button
                  key={kind}
                  leftSection={<Icon name="download" />}
                  title={t(`recordings.kind.${kind}`)}
                  aria-label={`${t('recordings.export', { kind: label })}: ${name}`}
                  onClick={() => void need(kind, false)}
                >
                  {label}
                </Button>
              )
            })}
          </>
        )
      )}
      {!running && (
        <ActionIcon aria-label={t('recordings.delete', { name })} onClick={() => setDeleting(true)}>
          <Icon name="cross" />
        </ActionIcon>
      )}
      {deleting && (
        <ConfirmDelete
          title={t('recordings.delete', { name })}
          action={t('recordings.deleteNow')}
          onClose={() => setDeleting(false)}
          onDelete={() => {
            setDeleting(false)
            void act.run(() => ask(api.DELETE('/api/v1/recordings/{name}', path))).then(onChanged)
          }}
        >
          <p>{t('recordings.deleteText')}</p>
        </ConfirmDelete>
      )}
    </article>
  )
}

/** Let the browser fetch the file itself: it may be larger than a page should hold. */
function fetchFile(name: string, kind: Kind): void {
  const anchor = document.createElement('a')
  anchor.href = `${API_ROOT}/api/v1/recordings/${encodeURIComponent(name)}/exports/${kind}`
  anchor.download = ''
  anchor.click()
}
