import { Button } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DriveSummary, HandedOverInfo, HandoverChanges } from '../../../api/schema'
import { useT } from '../../../i18n'
import { dateTime } from '../../../widgets/numbers/format'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { ConflictTable } from './ConflictTable'

/** What was handed over before; the drive is read again to say what has changed since. */
export function EarlierHandovers({ drive }: { drive: DriveSummary }) {
  const t = useT()
  const [made, setMade] = useState<HandedOverInfo[] | null>(null)
  const { problem, run, clear } = useAction()
  useEffect(() => {
    void run(async () => {
      const params = { path: { drive_id: drive.id } }
      setMade(await ask(api.GET('/api/v1/drives/{drive_id}/handovers', { params })))
    })
  }, [drive.id, run])
  return (
    <section aria-label={t('handover.earlier')}>
      <h3>{t('handover.earlier')}</h3>
      <ProblemNote problem={problem} onClose={clear} />
      {made?.length === 0 && <p className="empty">{t('handover.earlierNone')}</p>}
      {made?.map((each) => (
        <Earlier key={each.number} drive={drive} made={each} />
      ))}
    </section>
  )
}

function Earlier({ drive, made }: { drive: DriveSummary; made: HandedOverInfo }) {
  const t = useT()
  const act = useAction()
  const [found, setFound] = useState<HandoverChanges | null>(null)
  const check = () =>
    act.run(async () => {
      const params = { path: { drive_id: drive.id, number: made.number } }
      const path = '/api/v1/drives/{drive_id}/handovers/{number}/changes'
      setFound(await ask(api.GET(path, { params })))
    })
  return (
    <article className="set library-row" aria-label={made.file}>
      <div className="library-head">
        <div className="grow">
          <p className="library-name">
            <span className="library-kind">{made.format}</span>
            <strong>{made.file}</strong>
          </p>
          <p className="dim">
            {dateTime(made.time)} · {made.person} · {made.set_file}
          </p>
          <p className="mono dim handover-hash">{t('handover.hash', { sum: made.sha256 })}</p>
        </div>
        <div className="library-tools">
          <Button
            loading={act.busy}
            aria-label={t('handover.checkNamed', { file: made.file })}
            onClick={() => void check()}
          >
            {t('handover.check')}
          </Button>
        </div>
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {found && (
        <div role="status">
          {found.changed.length === 0 ? (
            <p>{t('handover.unchanged', { count: found.values - found.not_read.length })}</p>
          ) : (
            <>
              <p>{t('handover.changedCount', { count: found.changed.length })}</p>
              <ConflictTable rows={found.changed} controller="" />
            </>
          )}
          {found.not_read.length > 0 && (
            <p className="warn-text">
              {t('handover.notRead', { keys: found.not_read.join(', ') })}
            </p>
          )}
        </div>
      )}
    </article>
  )
}
