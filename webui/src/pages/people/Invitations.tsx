import { Button, Checkbox, NativeSelect, TextInput } from '@mantine/core'
import { type SyntheticEvent, useState } from 'react'
import type { InvitationView, MadeInvitation, Right } from '../../api/schema'
import { useT } from '../../i18n'
import { usePeople } from '../../live/people'
import { useDrives } from '../../live/store'
import { dateTime } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { GRANTABLE, rightsInWords } from './rights'
import { grant, invite, revoke, withdraw } from './support'

const LIFETIMES_MIN = [30, 60, 240, 480, 1440]
const GRANTS_MIN = [5, 15, 60]

/** Remote support: who is invited, and what they may do now. */
export function Invitations() {
  const t = useT()
  const here = usePeople()
  const [made, setMade] = useState<MadeInvitation | null>(null)
  const open = here?.invitations.filter((each) => each.state !== 'ended') ?? []
  const shown = made && open.find((each) => each.id === made.invitation.id)?.state === 'open'
  return (
    <Panel title={t('support.title')}>
      <p className="prose">{t('support.text')}</p>
      <Invite onMade={setMade} />
      {made && shown && <Reported made={made} />}
      {open.map((each) => (
        <Invited key={each.id} invitation={each} />
      ))}
    </Panel>
  )
}

function Invite({ onMade }: { onMade: (made: MadeInvitation) => void }) {
  const t = useT()
  const act = useAction()
  const [guest, setGuest] = useState('')
  const [minutes, setMinutes] = useState(60)
  const [allowed, setAllowed] = useState<Right[]>([])
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(async () => {
      onMade(await invite({ guest, minutes, allowed }))
      setGuest('')
    })
  }
  return (
    <form onSubmit={submit} className="fields">
      <TextInput
        label={t('support.guest')}
        value={guest}
        maxLength={60}
        required
        onChange={(event) => setGuest(event.currentTarget.value)}
      />
      <NativeSelect
        label={t('support.valid')}
        value={minutes}
        onChange={(event) => setMinutes(Number(event.currentTarget.value))}
        data={LIFETIMES_MIN.map((each) => ({
          value: String(each),
          label:
            each % 60 === 0
              ? t('support.hours', { hours: each / 60 })
              : t('support.minutes', { minutes: each }),
        }))}
      />
      <Rights
        label={t('support.allowed')}
        offered={GRANTABLE}
        chosen={allowed}
        onChange={setAllowed}
      />
      <Button type="submit" loading={act.busy} disabled={guest.trim() === ''}>
        {t('support.invite')}
      </Button>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </form>
  )
}

export function Rights(props: {
  label: string
  offered: Right[]
  chosen: Right[]
  onChange: (chosen: Right[]) => void
}) {
  const t = useT()
  return (
    <Checkbox.Group
      className="people-rights"
      label={props.label}
      value={props.chosen}
      onChange={(next) => props.onChange(next)}
    >
      <div className="row wrap middle">
        {props.offered.map((each) => (
          <Checkbox key={each} value={each} label={t(`right.${each}`)} className="tick" />
        ))}
      </div>
    </Checkbox.Group>
  )
}

/** Link and code, shown once; they go to the guest by two different ways. */
function Reported({ made }: { made: MadeInvitation }) {
  const t = useT()
  const [copied, setCopied] = useState(false)
  const link = `${window.location.origin}${window.location.pathname}#${made.link}`
  // A browser gives none to a page that came over a plain line.
  const clipboard = navigator.clipboard as Clipboard | undefined
  return (
    <div className="note info">
      <p>{t('support.send')}</p>
      <p className="row wrap middle">
        <span className="mono grow">{link}</span>
        {clipboard && (
          <Button
            variant="default"
            onClick={() => void clipboard.writeText(link).then(() => setCopied(true))}
          >
            {t(copied ? 'support.copied' : 'support.copy')}
          </Button>
        )}
      </p>
      <p>
        {t('support.tellCode')} <strong className="big mono">{made.invitation.code}</strong>
      </p>
    </div>
  )
}

function Invited({ invitation }: { invitation: InvitationView }) {
  const t = useT()
  const act = useAction()
  return (
    <article className="set">
      <div className="grow">
        <strong>{invitation.guest}</strong>{' '}
        <span className="dim">
          {t(`support.state.${invitation.state}`)} ·{' '}
          {t('support.until', { time: dateTime(invitation.expires) })} ·{' '}
          {invitation.allowed.length > 0
            ? t('support.mayGet', { rights: rightsInWords(t, invitation.allowed) })
            : t('support.looksOnly')}
          {invitation.code && (
            <>
              {' · '}
              {t('support.code')} <span className="mono">{invitation.code}</span>
            </>
          )}
        </span>
        {invitation.state === 'joined' && invitation.allowed.length > 0 && (
          <GrantForm invitation={invitation} />
        )}
        <ProblemNote problem={act.problem} onClose={act.clear} />
      </div>
      {invitation.grant && (
        <Button variant="default" onClick={() => void act.run(() => withdraw(invitation.id))}>
          {t('support.withdraw')}
        </Button>
      )}
      <Button color="red" onClick={() => void act.run(() => revoke(invitation.id))}>
        {t('support.revoke')}
      </Button>
    </article>
  )
}

function GrantForm({ invitation }: { invitation: InvitationView }) {
  const t = useT()
  const drives = useDrives() ?? []
  const act = useAction()
  const [rights, setRights] = useState<Right[]>(invitation.allowed)
  const [minutes, setMinutes] = useState(15)
  const [drive, setDrive] = useState('')
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(() => grant(invitation.id, { rights, minutes, drive: drive || null }))
  }
  return (
    <form onSubmit={submit} className="fields">
      <Rights
        label={t('support.grantWhat')}
        offered={invitation.allowed}
        chosen={rights}
        onChange={setRights}
      />
      <NativeSelect
        label={t('support.grantFor')}
        value={minutes}
        onChange={(event) => setMinutes(Number(event.currentTarget.value))}
        data={GRANTS_MIN.map((each) => ({
          value: String(each),
          label: t('support.minutes', { minutes: each }),
        }))}
      />
      <NativeSelect
        label={t('frame.axis')}
        value={drive}
        onChange={(event) => setDrive(event.currentTarget.value)}
        data={[
          { value: '', label: t('support.allAxes') },
          ...drives.map((each) => ({ value: each.id, label: each.name })),
        ]}
      />
      <Button type="submit" loading={act.busy} disabled={rights.length === 0}>
        {t('support.grant')}
      </Button>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </form>
  )
}
