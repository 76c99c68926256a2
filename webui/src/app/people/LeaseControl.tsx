import { Button, Menu } from '@mantine/core'
import { useEffect } from 'react'
import type { DriveSummary, LeaseNotice, PersonHere } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { dropNotice, useNotices, usePeople } from '../../live/people'
import { useDrive, useDrives } from '../../live/store'
import { clock } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { hasRight } from './session'

const LOANS_MIN = [5, 15, 60]

/** Who has control of the axis, and what one can do about it. */
export function LeaseControl({ drive: id }: { drive: string | null }) {
  const t = useT()
  const drive = useDrive(id)
  const here = usePeople()
  if (!drive) return null
  const { holder, mine } = drive.lease
  const words = mine
    ? t('control.mine')
    : holder
      ? t('control.other', { name: holder })
      : t('control.free')
  const badge = (press?: () => void) => (
    <button
      type="button"
      className={`badge control ${mine ? 'ready' : holder ? 'warn' : 'plain-badge'}`}
      title={mine ? t('control.give') : holder ? t('control.askFor') : t('control.take')}
      onClick={press}
    >
      <Icon name={mine || holder ? 'lock' : 'unlock'} size={16} />
      <span className="long">{words}</span>
      <span className="short">
        {mine ? t('control.short.mine') : (holder ?? t('control.short.free'))}
      </span>
    </button>
  )
  const others = here?.people.filter((each) => !each.me) ?? []
  // Alone, or with a free axis, one press does the only thing there is to do.
  if (!holder) return badge(() => live.send({ type: 'lease', drive: drive.id, take: true }))
  if (mine && others.length === 0) {
    return badge(() => live.send({ type: 'lease', drive: drive.id, take: false }))
  }
  return (
    <Menu position="bottom-end" zIndex={260}>
      <Menu.Target>{badge()}</Menu.Target>
      <Menu.Dropdown>
        {mine ? <Mine drive={drive} others={others} /> : <Theirs drive={drive} others={others} />}
      </Menu.Dropdown>
    </Menu>
  )
}

function Mine({ drive, others }: { drive: DriveSummary; others: PersonHere[] }) {
  const t = useT()
  const until = drive.lease.until
  return (
    <>
      {until && <Menu.Label>{t('control.until', { time: clock(until) })}</Menu.Label>}
      <Menu.Item onClick={() => live.send({ type: 'lease', drive: drive.id, take: false })}>
        {t('control.give')}
      </Menu.Item>
      {others
        .filter((each) => each.role !== 'viewer')
        .map((each) => (
          <div key={each.connection}>
            <Menu.Label>{t('control.handTo', { name: each.person })}</Menu.Label>
            <Menu.Item onClick={() => hand(drive.id, each, null)}>{t('control.forGood')}</Menu.Item>
            {LOANS_MIN.map((minutes) => (
              <Menu.Item key={minutes} onClick={() => hand(drive.id, each, minutes)}>
                {t('control.forMinutes', { minutes })}
              </Menu.Item>
            ))}
          </div>
        ))}
    </>
  )
}

function hand(drive: string, to: PersonHere, minutes: number | null) {
  live.send({
    type: 'lease_hand',
    drive,
    to: to.connection,
    time_s: minutes === null ? null : minutes * 60,
  })
}

function Theirs({ drive, others }: { drive: DriveSummary; others: PersonHere[] }) {
  const t = useT()
  const holder = others.find((each) => each.connection === drive.lease.connection)
  const mayTake = hasRight('administer') || (holder?.role === 'guest' && hasRight('invite'))
  return (
    <>
      <Menu.Item onClick={() => live.send({ type: 'lease_ask', drive: drive.id })}>
        {t('control.askFor')}
      </Menu.Item>
      {mayTake && (
        <Menu.Item
          className="fault-text"
          onClick={() => live.send({ type: 'lease_override', drive: drive.id })}
        >
          {t('control.override')}
        </Menu.Item>
      )}
    </>
  )
}

const SHOWN_MS = 20000

/** What somebody else did about control: must be seen, and a request must be answered. */
export function LeaseNotices() {
  const notices = useNotices()
  const drives = useDrives() ?? []
  const asked = drives.filter((each) => each.lease.mine && each.lease.asked_by)
  return (
    <>
      {asked.map((drive) => (
        <Request key={drive.id} drive={drive} />
      ))}
      {notices
        .filter((each) => each.kind !== 'asked')
        .map((each) => (
          <Notice key={each.at} notice={each} />
        ))}
    </>
  )
}

function Request({ drive }: { drive: DriveSummary }) {
  const t = useT()
  const answer = (give: boolean) => live.send({ type: 'lease_answer', drive: drive.id, give })
  return (
    <div className="note warn asked" role="alert">
      <p>
        <strong>{t('control.asks', { name: drive.lease.asked_by ?? '', axis: drive.name })}</strong>{' '}
        {drive.lease.asked_until && t('control.silence', { time: clock(drive.lease.asked_until) })}
      </p>
      <Button onClick={() => answer(true)}>{t('control.handOver')}</Button>
      <Button variant="default" onClick={() => answer(false)}>
        {t('control.keep')}
      </Button>
    </div>
  )
}

function Notice({ notice }: { notice: LeaseNotice & { at: number } }) {
  const t = useT()
  const drive = useDrive(notice.drive)
  useEffect(() => {
    const timer = setTimeout(() => dropNotice(notice.at), SHOWN_MS)
    return () => clearTimeout(timer)
  }, [notice.at])
  if (notice.kind === 'asked') return null
  const bad = notice.kind === 'overridden' || notice.kind === 'lost' || notice.kind === 'refused'
  return (
    <div className={`note ${bad ? 'warn' : 'good'}`} role="alert">
      <p>
        {t(`control.notice.${notice.kind}`, {
          name: notice.person,
          axis: drive?.name ?? notice.drive,
        })}
      </p>
      <button type="button" className="plain" onClick={() => dropNotice(notice.at)}>
        {t('close')}
      </button>
    </div>
  )
}
