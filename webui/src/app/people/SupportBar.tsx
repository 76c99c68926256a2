import { Button } from '@mantine/core'
import { type PointerEvent, useEffect, useRef, useState } from 'react'
import type { InvitationView, JogStop } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { usePeople } from '../../live/people'
import { contents, subscribe, useDrives } from '../../live/store'
import { clock } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { rightsInWords } from '../../pages/people/rights'
import { revoke, withdraw } from '../../pages/people/support'
import { useSession } from './session'

/** While a guest is here: for the guest what they may do, for everybody else what the guest may. */
export function SupportBar() {
  const here = usePeople()
  const session = useSession()
  if (!here) return null
  const joined = here.invitations.filter((each) => each.state === 'joined')
  if (session?.guest) {
    const mine = joined.find((each) => each.mine)
    return mine ? <AsGuest invitation={mine} /> : null
  }
  return (
    <>
      {joined.map((each) => (
        <AsHost key={each.id} invitation={each} />
      ))}
    </>
  )
}

function Granted({ invitation }: { invitation: InvitationView }) {
  const t = useT()
  const drives = useDrives() ?? []
  const { grant } = invitation
  if (!grant) return <>{t('support.looks')}</>
  // An axis that is not connected now is still the only one.
  const axis =
    grant.drive === null
      ? t('support.allAxes')
      : (drives.find((each) => each.id === grant.drive)?.name ?? grant.drive)
  return (
    <>
      {t('support.granted', {
        rights: rightsInWords(t, grant.rights),
        axis,
        time: clock(grant.until),
      })}
    </>
  )
}

const moves = (invitation: InvitationView) =>
  invitation.grant?.rights.some((each) => each === 'motion' || each === 'measure') ?? false

function AsGuest({ invitation }: { invitation: InvitationView }) {
  const t = useT()
  return (
    <div className="support guest" role="status">
      <Icon name="people" />
      <span className="grow">
        <strong>{t('support.youAreGuest', { name: invitation.by })}</strong>{' '}
        <Granted invitation={invitation} />
      </span>
      {moves(invitation) && (
        <span className={`badge ${invitation.enabled ? 'live' : 'off'}`}>
          <Icon name={invitation.enabled ? 'check' : 'hold'} size={16} />
          <span>{t(invitation.enabled ? 'support.enabled' : 'support.notEnabled')}</span>
        </span>
      )}
    </div>
  )
}

function AsHost({ invitation }: { invitation: InvitationView }) {
  const t = useT()
  const act = useAction()
  const page = usePeople()?.people.find(
    (each) => each.role === 'guest' && each.person.startsWith(`${invitation.guest} `),
  )?.page
  return (
    <div className="support host" role="status">
      <Icon name="people" />
      <span className="grow">
        <strong>{t('support.guestHere', { name: invitation.guest })}</strong>{' '}
        <Granted invitation={invitation} />{' '}
        {page && <a href={`#${page}`}>{t('support.goWhere')}</a>}
      </span>
      {moves(invitation) && <EnablingButton invitation={invitation} />}
      {invitation.grant && (
        <Button variant="default" onClick={() => void act.run(() => withdraw(invitation.id))}>
          {t('support.withdraw')}
        </Button>
      )}
      <Button color="red" onClick={() => void act.run(() => revoke(invitation.id))}>
        {t('support.revoke')}
      </Button>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}

const BEAT_MS = 30

/** Hold to let the guest move. Letting go, leaving, hiding or losing focus stops what moves. */
function EnablingButton({ invitation }: { invitation: InvitationView }) {
  const t = useT()
  const [held, setHeld] = useState(false)
  const stop = useRef<((why: JogStop['reason']) => void) | null>(null)
  const pointer = useRef<number | null>(null)
  const press = () => {
    if (stop.current || document.visibilityState !== 'visible') return
    live.enablePress(invitation.id)
    setHeld(true)
    const beat = setInterval(() => live.enableBeat(), BEAT_MS)
    const release = (why: JogStop['reason']) => {
      if (stop.current !== release) return
      stop.current = null
      pointer.current = null
      clearInterval(beat)
      for (const end of ends) end()
      window.removeEventListener('blur', blur)
      window.removeEventListener('pagehide', hidden)
      document.removeEventListener('visibilitychange', hidden)
      live.enableRelease(why)
      setHeld(false)
    }
    const blur = () => release('focus-lost')
    const hidden = () => release('page-hidden')
    window.addEventListener('blur', blur)
    window.addEventListener('pagehide', hidden)
    document.addEventListener('visibilitychange', hidden)
    const ends = [
      subscribe('link', () => {
        if (!contents.link.open) release('connection-lost')
      }),
      subscribe('enableEnded', () => release('page-silent')),
    ]
    stop.current = release
  }
  const release = () => stop.current?.('released')
  useEffect(() => () => stop.current?.('page-left'), [])
  const down = (event: PointerEvent<HTMLButtonElement>) => {
    if (event.button !== 0) return
    event.currentTarget.setPointerCapture(event.pointerId)
    pointer.current = event.pointerId
    press()
  }
  return (
    <button
      type="button"
      className={`enabling ${held ? 'held' : ''}`}
      aria-pressed={held}
      onPointerDown={down}
      // A mouse whose other button is held down as well lets go of this one with a move alone.
      onPointerMove={(event) => {
        if (pointer.current === event.pointerId && (event.buttons & 1) === 0) release()
      }}
      onPointerUp={release}
      onPointerCancel={release}
      onLostPointerCapture={release}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (event.key === ' ' || event.key === 'Enter') {
          event.preventDefault()
          if (!event.repeat) press()
        }
      }}
      onKeyUp={release}
      onBlur={release}
    >
      <Icon name={held ? 'check' : 'hold'} size={20} />
      <span>{t(held ? 'support.holding' : 'support.hold')}</span>
    </button>
  )
}
