import { Button, Checkbox, Modal } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { Diff, DriveSummary, MessageInfo } from '../../api/schema'
import { plainResult } from '../../api/results'
import { useT } from '../../i18n'
import { setJob, useJob } from '../../live/store'
import { JobNote, useJobEnd } from '../../widgets/jobs/JobNote'
import { Said } from '../../widgets/messages/Said'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import type { Raw } from '../../widgets/parameters/types'
import { useAction } from '../../widgets/requests/useAction'

interface Row {
  key: string
  before: Raw | null
  wanted: Raw
  after: Raw | null
  ok: boolean
  problem: string
  problem_message?: MessageInfo | null
}

/** Load the ticked rows of a file: verified writes, then what became of each. */
export function LoadReport({
  drive,
  diff,
  keys,
  onDone,
}: {
  drive: DriveSummary
  /** Of which set, and whether it is this drive's. */
  diff: Pick<Diff, 'file' | 'same_profile' | 'same_serial'> & { version?: number | null }
  keys: string[]
  onDone: () => void
}) {
  const t = useT()
  const [open, setOpen] = useState(false)
  const [accept, setAccept] = useState(false)
  const [sameMotor, setSameMotor] = useState(false)
  const [id, setId] = useState<string | null>(null)
  const job = useJob(id)
  const load = useAction()
  useJobEnd(id, onDone)
  const start = () =>
    load.run(async () => {
      const begun = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/load_set', {
          params: { path: { drive_id: drive.id } },
          body: {
            file: diff.file,
            version: diff.version ?? null,
            keys,
            accept_other_identity: accept,
            accept_motor_individual: accept && sameMotor,
          },
        }),
      )
      setJob(begun)
      setId(begun.id)
    })
  const plain = plainResult(job?.result)
  const rows = (plain.rows ?? []) as Row[]
  const close = () => {
    setOpen(false)
    setId(null)
    setAccept(false)
    setSameMotor(false)
  }
  return (
    <>
      <Button
        variant="filled"
        disabled={keys.length === 0 || !diff.same_profile}
        onClick={() => setOpen(true)}
      >
        {t('load.open', { count: keys.length })}
      </Button>
      {open && (
        <Modal opened onClose={close} title={t('load.title', { file: diff.file })} size="xl">
          {job === null && (
            <>
              <p>{t('load.text', { count: keys.length, name: drive.name })}</p>
              {diff.same_serial === false && (
                <>
                  <Checkbox
                    label={t('load.otherDrive')}
                    checked={accept}
                    onChange={(event) => setAccept(event.currentTarget.checked)}
                  />
                  <Checkbox
                    label={t('load.sameMotor')}
                    disabled={!accept}
                    checked={accept && sameMotor}
                    onChange={(event) => setSameMotor(event.currentTarget.checked)}
                  />
                </>
              )}
              <ProblemNote problem={load.problem} />
              <div className="row end">
                <Button onClick={close}>{t('cancel')}</Button>
                <Button
                  variant="filled"
                  disabled={diff.same_serial === false && !accept}
                  loading={load.busy}
                  onClick={() => void start()}
                >
                  {t('load.start')}
                </Button>
              </div>
            </>
          )}
          <JobNote id={id} />
          {job && job.state !== 'running' && (
            <>
              {job.result && (
                <p>
                  <strong>
                    {t('load.report', {
                      written: Number(plain.written ?? 0),
                      failed: Number(plain.failed ?? 0),
                    })}
                  </strong>{' '}
                  {typeof plain.backup === 'string' && t('load.backup', { file: plain.backup })}
                </p>
              )}
              {rows.length > 0 && (
                <div className="scroll-table">
                  <table>
                    <thead>
                      <tr>
                        <th>{t('column.key')}</th>
                        <th className="right">{t('load.before')}</th>
                        <th className="right">{t('load.wanted')}</th>
                        <th className="right">{t('load.after')}</th>
                        <th>{t('load.result')}</th>
                      </tr>
                    </thead>
                    <tbody>
                      {rows.map((row) => (
                        <tr key={row.key}>
                          <td className="mono">{row.key}</td>
                          <td className="num right">{String(row.before ?? '—')}</td>
                          <td className="num right">{String(row.wanted)}</td>
                          <td className="num right">{String(row.after ?? '—')}</td>
                          <td className={row.ok ? '' : 'warn-text'}>
                            {row.ok ? (
                              t('load.ok')
                            ) : (
                              <Said message={row.problem_message} words={row.problem} />
                            )}
                          </td>
                        </tr>
                      ))}
                    </tbody>
                  </table>
                </div>
              )}
              <p className="note info">{t('load.notSaved')}</p>
              <div className="row end">
                <Button onClick={close}>{t('close')}</Button>
              </div>
            </>
          )}
        </Modal>
      )}
    </>
  )
}
