import { Button, Modal } from '@mantine/core'
import type { ReactNode } from 'react'
import type { Problem } from '../../api/schema'
import { useT } from '../../i18n'
import { ProblemNote } from './ProblemNote'

/** Asks before something goes; `action` is the word on the button that does it. */
export function ConfirmDelete({
  title,
  action,
  busy = false,
  problem = null,
  onClose,
  onDelete,
  children,
}: {
  title: string
  action: string
  busy?: boolean
  problem?: Problem | null
  onClose: () => void
  onDelete: () => void
  children?: ReactNode
}) {
  const t = useT()
  return (
    <Modal opened onClose={onClose} title={title}>
      {children}
      <ProblemNote problem={problem} />
      <div className="row end">
        <Button onClick={onClose}>{t('cancel')}</Button>
        <Button color="red" variant="filled" loading={busy} onClick={onDelete}>
          {action}
        </Button>
      </div>
    </Modal>
  )
}
