import { Button, Modal, Textarea, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DriveSummary } from '../../../api/schema'
import { href } from '../../../app/navigation/router'
import { linkLook } from '../../../app/navigation/states'
import { useSay, useT } from '../../../i18n'
import { ConfirmDelete } from '../../../widgets/messages/ConfirmDelete'
import { Icon } from '../../../widgets/layout/Icon'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { MissingPorts } from './MissingPorts'
import { QualityTable } from './QualityTable'

/** A drive of the bench: identity, connection, name and notes. */
export function BenchDrive({ drive }: { drive: DriveSummary }) {
  const t = useT()
  const say = useSay()
  const [editing, setEditing] = useState(false)
  const [removing, setRemoving] = useState(false)
  const accept = useAction()
  const look = linkLook(drive.quality)
  const acceptIdentity = () =>
    accept.run(() =>
      ask(
        api.PATCH('/api/v1/drives/{drive_id}', {
          params: { path: { drive_id: drive.id } },
          body: { accept_identity: true },
        }),
      ),
    )
  return (
    <article className="bench-drive">
      <div className="row middle">
        <a className="grow big" href={href('overview', drive.id)}>
          {drive.name}
        </a>
        <span className={`badge plain-badge ${look.tone}-text`}>
          <Icon name="link" size={16} /> {t(`link.${look.word}`)}
        </span>
      </div>
      <p>
        {drive.title.startsWith(drive.maker) ? drive.title : `${drive.maker} ${drive.title}`}
        {drive.partial && <em className="warn-text"> {t('connect.partial')}</em>}
      </p>
      {drive.identity_warning && (
        <div className="note fault" role="alert">
          <p>
            <strong>{t('connect.swapped')}</strong>{' '}
            {say.message(drive.identity_warning_message, drive.identity_warning)}
          </p>
          <Button loading={accept.busy} onClick={() => void acceptIdentity()}>
            {t('connect.accept')}
          </Button>
          <ProblemNote problem={accept.problem} onClose={accept.clear} />
        </div>
      )}
      <p className="dim">
        {[
          drive.serial !== null && `${t('identity.serial')} ${drive.serial}`,
          drive.firmware && `${t('identity.firmware')} ${drive.firmware}`,
        ]
          .filter(Boolean)
          .join(' · ')}
      </p>
      {drive.ports.map((port) => (
        <p key={`${port.url} ${port.station}`} className="dim mono">
          {port.url} · {t('connect.station', { station: port.station })}
          <span className={port.watchdog ? '' : 'warn-text'}>
            {' · '}
            {t(port.watchdog ? 'connect.watchdog' : 'connect.noWatchdog')}
          </span>
        </p>
      ))}
      <MissingPorts drive={drive} />
      {drive.notes && <p className="notes">{drive.notes}</p>}
      <details>
        <summary>{t('connect.quality')}</summary>
        <QualityTable quality={drive.quality} />
      </details>
      <div className="row">
        <Button onClick={() => setEditing(true)}>{t('connect.rename')}</Button>
        <Button onClick={() => setRemoving(true)}>{t('connect.remove')}</Button>
      </div>
      {editing && <Rename drive={drive} onClose={() => setEditing(false)} />}
      {removing && <Remove drive={drive} onClose={() => setRemoving(false)} />}
    </article>
  )
}

function Rename({ drive, onClose }: { drive: DriveSummary; onClose: () => void }) {
  const t = useT()
  const [name, setName] = useState(drive.name)
  const [notes, setNotes] = useState(drive.notes)
  const save = useAction()
  return (
    <Modal opened onClose={onClose} title={t('connect.rename')}>
      <TextInput
        label={t('connect.name')}
        value={name}
        maxLength={60}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Textarea
        label={t('connect.notes')}
        value={notes}
        maxLength={4000}
        rows={4}
        onChange={(event) => setNotes(event.currentTarget.value)}
      />
      <ProblemNote problem={save.problem} />
      <div className="row end">
        <Button onClick={onClose}>{t('cancel')}</Button>
        <Button
          variant="filled"
          disabled={name.trim() === ''}
          loading={save.busy}
          onClick={async () => {
            const saved = await save.run(() =>
              ask(
                api.PATCH('/api/v1/drives/{drive_id}', {
                  params: { path: { drive_id: drive.id } },
                  body: { name: name.trim(), notes, accept_identity: false },
                }),
              ),
            )
            if (saved) onClose()
          }}
        >
          {t('store')}
        </Button>
      </div>
    </Modal>
  )
}

function Remove({ drive, onClose }: { drive: DriveSummary; onClose: () => void }) {
  const t = useT()
  const remove = useAction()
  return (
    <ConfirmDelete
      title={t('connect.remove')}
      action={t('connect.remove')}
      busy={remove.busy}
      problem={remove.problem}
      onClose={onClose}
      onDelete={async () => {
        const done = await remove.run(() =>
          ask(
            api.DELETE('/api/v1/drives/{drive_id}', {
              params: { path: { drive_id: drive.id } },
            }),
          ),
        )
        if (done) onClose()
      }}
    >
      <p>{t('connect.removeText', { name: drive.name })}</p>
      {drive.unsaved > 0 && (
        <p className="warn-text">{t('connect.removeUnsaved', { count: drive.unsaved })}</p>
      )}
    </ConfirmDelete>
  )
}
