import { Button } from '@mantine/core'
import { useState } from 'react'
import type { ParameterRow } from '../../api/schema'
import { hasRight, useSession } from '../../app/people/session'
import { useSay, useT } from '../../i18n'
import { MotionSetting } from './MotionSetting'

/** Where an object is set that can move the axis, and so has no field in the table. */
export function OtherPlace({ drive, row }: { drive: string; row: ParameterRow }) {
  const t = useT()
  const say = useSay()
  const page = row.motion_page
  return (
    <div className="note warn">
      <p>{t('motion.energises')}</p>
      {page === 'motion' || page === 'io' ? (
        <a className="page-link" href={`#/axis/${encodeURIComponent(drive)}/${page}`}>
          {t(page === 'io' ? 'motion.goIo' : 'motion.goMotion')}
        </a>
      ) : page === 'parameters' ? (
        <p>{t('motion.procedure', { how: say.message(row.motion_how_message, row.motion_how) })}</p>
      ) : (
        row.reachable && <SetIt key={row.key} drive={drive} row={row} />
      )}
    </div>
  )
}

/** The way to a setting that no page is made for; who may not take it reads why. */
function SetIt({ drive, row }: { drive: string; row: ParameterRow }) {
  const t = useT()
  const [open, setOpen] = useState(false)
  useSession()
  if (!hasRight('motion')) return <p>{t('motion.noRight')}</p>
  return (
    <>
      <Button onClick={() => setOpen(true)}>{t('motion.set')}</Button>
      {open && <MotionSetting drive={drive} row={row} onClose={() => setOpen(false)} />}
    </>
  )
}
