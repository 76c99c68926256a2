import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import { setJob, useDrive } from '../../live/store'
import { JobNote } from '../jobs/JobNote'
import { ProblemNote } from '../messages/ProblemNote'
import { useAction } from '../requests/useAction'

/** What a motion changed and could not restore, with one press to do so once the drive answers. */
export function PendingRestoresNote({ drive }: { drive: string }) {
  const t = useT()
  const summary = useDrive(drive)
  const act = useAction()
  const [started, setStarted] = useState<string | null>(null)
  const reported = <JobNote id={started} onClose={() => setStarted(null)} />
  if (!summary || summary.pending_restores.length === 0) return reported
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
        <strong>{t('pending.title', { count: summary.pending_restores.length })}</strong>{' '}
        {t(summary.connected ? 'pending.offered' : 'pending.text')}
      </p>
      <details>
        <summary>{t('pending.which')}</summary>
        <dl className="facts">
          {summary.pending_restores.map((each) => (
            <div key={each.key} className="pair">
              <dt>
                <span className="mono">{each.key}</span> {each.name}
              </dt>
              <dd className="mono">
                {each.raw}
                {each.unapplied && ` (${t('pending.unapplied')})`}
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
          {t('pending.putBack')}
        </Button>
        <Button disabled={act.busy} onClick={() => void leave()}>
          {t('pending.leave')}
        </Button>
      </div>
      {!summary.connected && <p className="dim">{t('pending.waits')}</p>}
      {reported}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}
