import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../api/client'
import { useT } from '../i18n'
import { setJob, useDrive } from '../live/store'
import { JobNote } from './JobNote'
import { ProblemNote } from './ProblemNote'
import { useAction } from './useAction'

/** What a motion changed and could not put back, with one press to do so once the drive answers. */
export function PendingRestoresNote({ drive }: { drive: string }) {
  const t = useT()
  const summary = useDrive(drive)
  const act = useAction()
  const [started, setStarted] = useState<string | null>(null)
  const told = <JobNote id={started} onClose={() => setStarted(null)} />
  if (!summary || summary.pending_restores.length === 0) return told
  const path = { params: { path: { drive_id: drive } } }
  const putBack = () =>
    act.run(async () => {
      const job = await ask(api.POST('/api/v1/drives/{drive_id}/jobs/put-back', path))
      setJob(job)
      setStarted(job.id)
    })
  const leave = () =>
    act.run(() => ask(api.DELETE('/api/v1/drives/{drive_id}/pending-restores', path)))
  return (
    <div className="note warn" role="alert">
      <p>
        <strong>{t('owed.title', { count: summary.pending_restores.length })}</strong>{' '}
        {t(summary.connected ? 'owed.offered' : 'owed.text')}
      </p>
      <details>
        <summary>{t('owed.which')}</summary>
        <dl className="facts">
          {summary.pending_restores.map((each) => (
            <div key={each.key} className="pair">
              <dt>
                <span className="mono">{each.key}</span> {each.name}
              </dt>
              <dd className="mono">
                {each.raw}
                {each.unapplied && ` (${t('owed.unapplied')})`}
              </dd>
            </div>
          ))}
        </dl>
      </details>
      <div className="row wrap">
        <Button
          variant="filled"
          disabled={!summary.connected}
          loading={act.busy}
          onClick={() => void putBack()}
        >
          {t('owed.putBack')}
        </Button>
        <Button disabled={act.busy} onClick={() => void leave()}>
          {t('owed.leave')}
        </Button>
      </div>
      {!summary.connected && <p className="dim">{t('owed.waits')}</p>}
      {told}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}
