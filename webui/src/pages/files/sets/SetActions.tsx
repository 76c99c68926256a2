import { Button, Checkbox, Modal, Textarea, TextInput } from '@mantine/core'
import { useRef, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DriveSummary, ImportedList } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { Icon } from '../../../widgets/layout/Icon'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

/** Names the server takes (SaveSetRequest.file). */
const NAME = /^\w[\w .-]{0,100}$/
const AUTHOR = 'servodeck.author'

/** Read the drive's settings and store them as a file. */
export function SaveSet({ drive, onSaved }: { drive: DriveSummary; onSaved: () => void }) {
  const t = useT()
  const [open, setOpen] = useState(false)
  const today = new Date().toISOString().slice(0, 10)
  const [file, setFile] = useState('')
  const [author, setAuthor] = useState(() => localStorage.getItem(AUTHOR) ?? '')
  const [notes, setNotes] = useState('')
  const [individual, setIndividual] = useState(false)
  const [overwrite, setOverwrite] = useState(false)
  const save = useAction()
  const begin = () => {
    setFile(`${drive.name.replace(/[^\w .-]/g, '_')} ${today}`)
    setOverwrite(false)
    save.clear()
    setOpen(true)
  }
  const store = async () => {
    localStorage.setItem(AUTHOR, author)
    const ok = await save.run(() =>
      ask(
        api.POST('/api/v1/drives/{drive_id}/sets', {
          params: { path: { drive_id: drive.id } },
          body: { file, author, notes, include_motor_individual: individual, overwrite },
        }),
      ),
    )
    if (ok) {
      setOpen(false)
      onSaved()
    }
  }
  return (
    <>
      <Button onClick={begin} leftSection={<Icon name="files" />}>
        {t('sets.save')}
      </Button>
      {open && (
        <Modal
          opened
          onClose={() => setOpen(false)}
          title={t('sets.saveTitle', { name: drive.name })}
        >
          <TextInput
            label={t('sets.name')}
            value={file}
            error={NAME.test(file) ? null : t('sets.nameBad')}
            onChange={(event) => setFile(event.currentTarget.value)}
          />
          <TextInput
            label={t('sets.author')}
            value={author}
            maxLength={100}
            onChange={(event) => setAuthor(event.currentTarget.value)}
          />
          <Textarea
            label={t('sets.notes')}
            value={notes}
            rows={3}
            maxLength={4000}
            onChange={(event) => setNotes(event.currentTarget.value)}
          />
          <Checkbox
            label={t('sets.individual')}
            description={t('sets.individualHelp')}
            checked={individual}
            onChange={(event) => setIndividual(event.currentTarget.checked)}
          />
          <Checkbox
            label={t('sets.overwrite')}
            checked={overwrite}
            onChange={(event) => setOverwrite(event.currentTarget.checked)}
          />
          <ProblemNote problem={save.problem} />
          <div className="row end">
            <Button onClick={() => setOpen(false)}>{t('cancel')}</Button>
            <Button
              variant="filled"
              disabled={!NAME.test(file)}
              loading={save.busy}
              onClick={() => void store()}
            >
              {t('store')}
            </Button>
          </div>
        </Modal>
      )}
    </>
  )
}

const LIST = /\.(csv|dcf|txt)$/i

/**
 * Store a file from this computer; the server refuses what is no usable parameter set. A list of
 * another tool (CSV, DCF) becomes a set of this drive's family.
 */
export function UploadSet({
  drive,
  onStored,
}: {
  drive: DriveSummary | null
  onStored: (file: string) => void
}) {
  const t = useT()
  const say = useSay()
  const input = useRef<HTMLInputElement>(null)
  const upload = useAction()
  const [list, setList] = useState<ImportedList | null>(null)
  const send = (file: File) =>
    upload.run(async () => {
      setList(null)
      if (drive && LIST.test(file.name)) {
        const stored = await ask(
          api.POST('/api/v1/sets/list', {
            params: {
              query: {
                profile: drive.profile,
                file: file.name.replace(LIST, '').replace(/[^\w .-]/g, '_'),
              },
            },
            body: file as never,
            bodySerializer: (body: unknown) => body as BodyInit,
            headers: { 'Content-Type': 'text/plain' },
          }),
        )
        setList(stored)
        onStored(stored.file)
        return
      }
      const stored = await ask(
        api.PUT('/api/v1/sets/{file}', {
          params: { path: { file: file.name }, query: { overwrite: false } },
          body: file as never,
          bodySerializer: (body: unknown) => body as BodyInit,
          headers: { 'Content-Type': 'application/toml' },
        }),
      )
      onStored(stored.file)
    })
  return (
    <>
      <input
        ref={input}
        type="file"
        hidden
        accept={drive ? '.sdset,.toml,.csv,.dcf,text/plain' : '.sdset,.toml,text/plain'}
        aria-label={t('sets.upload')}
        onChange={(event) => {
          const file = event.currentTarget.files?.[0]
          event.currentTarget.value = ''
          if (file) void send(file)
        }}
      />
      <Button
        loading={upload.busy}
        leftSection={<Icon name="upload" />}
        onClick={() => input.current?.click()}
      >
        {t('sets.upload')}
      </Button>
      <ProblemNote problem={upload.problem} onClose={upload.clear} />
      {list && (
        <Modal opened onClose={() => setList(null)} title={list.file}>
          <p>{t('sets.listRead', { count: list.parameters })}</p>
          {list.problems.length > 0 && (
            <>
              <p className="warn-text">{t('sets.listProblems')}</p>
              <ul>
                {say.messages(list.problem_messages, list.problems).map((problem) => (
                  <li key={problem}>{problem}</li>
                ))}
              </ul>
            </>
          )}
          <div className="row end">
            <Button onClick={() => setList(null)}>{t('close')}</Button>
          </div>
        </Modal>
      )}
    </>
  )
}
