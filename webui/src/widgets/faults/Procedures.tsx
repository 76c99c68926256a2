import { Button, Checkbox, Modal } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { JobInfo, MessageInfo, ProcedureInfo } from '../../api/schema'
import { known, useSay, useT } from '../../i18n'
import { setJob, useLink } from '../../live/store'
import { JobNote, useJobEnd } from '../jobs/JobNote'
import { Panel } from '../layout/Panel'
import { ProblemNote } from '../messages/ProblemNote'
import { OriginalSwitch, ProfileText } from '../profile-text/ProfileText'
import { useTexts } from '../profile-text/texts'
import { useAction } from '../requests/useAction'
import { WaitingValues } from '../parameters/WaitingValues'

/** The procedures of a drive's profile; null until they are known. */
export function useProcedures(drive: string): ProcedureInfo[] | null {
  const [list, setList] = useState<ProcedureInfo[] | null>(null)
  const { open } = useLink()
  useEffect(() => {
    if (!open) return
    let current = true
    ask(
      api.GET('/api/v1/drives/{drive_id}/procedures', { params: { path: { drive_id: drive } } }),
    ).then(
      (found) => current && setList(found),
      () => {}, // asked again when the connection is back
    )
    return () => {
      current = false
    }
  }, [drive, open])
  return list
}

/** All procedures of a drive, each behind the texts that must be agreed to. */
export function Procedures({ drive }: { drive: string }) {
  const t = useT()
  const list = useProcedures(drive)
  const texts = useTexts(drive)
  const [chosen, setChosen] = useState<ProcedureInfo | null>(null)
  const [job, setId] = useState<string | null>(null)
  if (!list || list.length === 0) return null
  return (
    <Panel title={t('procedures.title')}>
      <div className="row wrap">
        {list.map((each) => (
          <Button key={each.name} onClick={() => setChosen(each)}>
            {texts?.get(each.title) ?? known(t, 'procedure', each.title)}
          </Button>
        ))}
      </div>
      <JobNote id={job} onClose={() => setId(null)} />
      {chosen && (
        <ProcedureDialog
          drive={drive}
          procedure={chosen}
          onClose={() => setChosen(null)}
          onStarted={setId}
        />
      )}
    </Panel>
  )
}

/** What a procedure will do, what must be agreed to, and the button that starts it. */
export function ProcedureDialog({
  drive,
  procedure,
  onClose,
  onStarted,
}: {
  drive: string
  procedure: ProcedureInfo
  onClose: () => void
  onStarted: (job: string) => void
}) {
  const t = useT()
  const [agreed, setAgreed] = useState<boolean[]>(procedure.confirm.map(() => false))
  const run = useAction()
  const texts = useTexts(drive)
  const say = useSay()
  const title = texts?.get(procedure.title) ?? known(t, 'procedure', procedure.title)
  // What is to be confirmed is a text of the profile, which has its own translations.
  const inLanguage = (step: MessageInfo | undefined): MessageInfo | undefined => {
    const text = step?.params?.text
    return step && typeof text === 'string'
      ? { ...step, params: { ...step.params, text: texts?.get(text) ?? text } }
      : step
  }
  const start = async () => {
    const ok = await run.run(async () => {
      const job = await ask(
        api.POST('/api/v1/drives/{drive_id}/procedures/{name}', {
          params: { path: { drive_id: drive, name: procedure.name } },
          body: { confirmed: true },
        }),
      )
      setJob(job)
      onStarted(job.id)
    })
    if (ok) onClose()
  }
  return (
    <Modal opened onClose={onClose} title={title}>
      <OriginalSwitch />
      <p>
        <ProfileText drive={drive} text={procedure.help} />
      </p>
      <WaitingValues drive={drive} procedure={procedure.name} />
      {procedure.warning && (
        <p className="note warn">
          <ProfileText drive={drive} text={procedure.warning} />
        </p>
      )}
      {procedure.requires_stop && <p>{t('procedures.stopped')}</p>}
      <details>
        <summary>{t('procedures.steps', { count: procedure.steps.length })}</summary>
        <ol>
          {procedure.steps.map((step, i) => (
            <li key={i}>{say.message(inLanguage(procedure.step_messages?.[i]), step)}</li>
          ))}
        </ol>
        {procedure.notes && (
          <p className="dim">
            <ProfileText drive={drive} text={procedure.notes} />
          </p>
        )}
        <p className="dim">{t('source', { source: procedure.source })}</p>
      </details>
      {procedure.confirm.map((text, i) => (
        <Checkbox
          key={text}
          label={<ProfileText drive={drive} text={text} />}
          checked={agreed[i] ?? false}
          onChange={(event) => setAgreed(agreed.with(i, event.currentTarget.checked))}
        />
      ))}
      <ProblemNote problem={run.problem} />
      <div className="row end">
        <Button onClick={onClose}>{t('cancel')}</Button>
        <Button
          variant="filled"
          disabled={!agreed.every(Boolean)}
          loading={run.busy}
          onClick={() => void start()}
        >
          {t('procedures.run')}
        </Button>
      </div>
    </Modal>
  )
}

/** A button for one well-known procedure, where the drive has it. */
export function ProcedureButton({
  drive,
  name,
  label,
  onEnd,
  variant = 'default',
}: {
  drive: string
  name: string
  label: string
  onEnd?: (job: JobInfo) => void
  variant?: 'default' | 'filled'
}) {
  const procedure = useProcedures(drive)?.find((each) => each.name === name)
  const [open, setOpen] = useState(false)
  const [job, setId] = useState<string | null>(null)
  useJobEnd(job, (ended) => onEnd?.(ended))
  if (!procedure) return null
  return (
    <>
      <Button variant={variant} onClick={() => setOpen(true)}>
        {label}
      </Button>
      {job && <JobNote id={job} onClose={() => setId(null)} />}
      {open && (
        <ProcedureDialog
          drive={drive}
          procedure={procedure}
          onClose={() => setOpen(false)}
          onStarted={setId}
        />
      )}
    </>
  )
}
