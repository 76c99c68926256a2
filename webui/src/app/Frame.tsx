import { ActionIcon, Drawer, NativeSelect } from '@mantine/core'
import { type ReactNode, useEffect, useRef, useState } from 'react'
import { known, problemTitle, useSay, useT } from '../i18n'
import * as live from '../live/live'
import { contents, useAxisState, useDrive, useDrives, useLink, useStore } from '../live/store'
import { clock } from '../widgets/numbers/format'
import { Icon } from '../widgets/layout/Icon'
import { PendingRestoresNote } from '../widgets/parameters/PendingRestoresNote'
import { StateName } from '../widgets/drive/StateName'
import {
  AXIS_PAGES,
  BENCH_PAGES,
  chooseDrive,
  href,
  isAxisPage,
  type Page,
  useRoute,
} from './navigation/router'
import { FaultElsewhere } from './notes/FaultElsewhere'
import { AxisNotes } from './notes/AxisNotes'
import { Late } from './notes/Late'
import { LanguageSwitch } from './LanguageSwitch'
import { LeaseControl, LeaseNotices } from './people/LeaseControl'
import { PointerLayer } from './stop/PointerLayer'
import { Preferences } from './Preferences'
import { StopButton } from './stop/StopButton'
import { currentReport } from './stop/stop'
import { StopElsewhere } from './stop/StopElsewhere'
import { SupportBar } from './people/SupportBar'
import { Tour } from './tour/Tour'
import { TurningNote } from './notes/TurningNote'
import { linkLook, stateLook } from './navigation/states'
import { useCanTune } from './navigation/useCanTune'
import { useHasIo } from './navigation/useHasIo'

/** What a thumb reaches on a phone: with an axis, and before there is one. */
const HANDY = ['overview', 'parameters', 'motion', 'scope', 'alarms'] as const
/** More than these are listed in one line each, so that all of them are in sight. */
const FEW_AXES = 2
const EMPTY_BENCH = ['connect', 'files', 'people'] as const

/** What surrounds every page: axis, state, link, control, STOP, and the way to the pages. */
export function Frame({ children }: { children: ReactNode }) {
  const t = useT()
  const [open, setOpen] = useState(false)
  const { page, drive } = useRoute()
  const drives = useDrives()
  useEffect(() => {
    live.stand('watch_state', {
      type: 'watch_state',
      drives: (drives ?? []).map((each) => each.id).slice(0, 64),
    })
  }, [drives?.map((each) => each.id).join(' ')])
  const chosen = useChosen()
  const key = `${page} ${drive}`
  useEffect(() => setOpen(false), [key])
  const axis = useDrive(isAxisPage(page) ? drive : null)
  useEffect(() => {
    // Tabs, bookmarks and screen readers distinguish pages by it.
    const names = [axis?.name, t(`page.${page}`), 'servodeck']
    document.title = names.filter(Boolean).join(' · ')
  }, [axis?.name, page, t(`page.${page}`)])
  return (
    <div className="frame">
      <button
        type="button"
        className="skip"
        onClick={() => document.getElementById('main')?.focus()}
      >
        {t('frame.skip')}
      </button>
      <header className="top">
        <ActionIcon className="burger" aria-label={t('frame.menu')} onClick={() => setOpen(true)}>
          <Icon name="menu" size={24} />
        </ActionIcon>
        <span className="brand">servodeck</span>
        <AxisPicker />
        <div className="top-status">
          <StateBadge />
          <FaultElsewhere chosen={chosen} />
          <LinkBadge />
          <LeaseControl drive={chosen} />
        </div>
        <div className="wide-only row">
          <LanguageSwitch />
          <Preferences />
        </div>
      </header>
      <StopButton />
      <StopElsewhere />
      <ConnectionLost />
      <nav className="side" aria-label={t('frame.pages')}>
        <Pages />
      </nav>
      <Drawer
        opened={open}
        onClose={() => setOpen(false)}
        size={260}
        title="servodeck"
        zIndex={250}
      >
        <Pages />
        <div className="narrow-only row">
          <LanguageSwitch />
          <Preferences onTour={() => setOpen(false)} />
        </div>
      </Drawer>
      <main id="main" tabIndex={-1}>
        <Late page={key}>
          <TurningNote />
          <Refused />
          <LeaseNotices />
          <SupportBar />
          {axis && <AxisNotes key={key} drive={axis.id} page={page} />}
          {axis && <PendingRestoresNote key={`restores ${axis.id}`} drive={axis.id} />}
        </Late>
        <div className="room">{children}</div>
      </main>
      <Tour />
      <PointerLayer />
      <nav className="bottom" aria-label={t('frame.pages')}>
        {(chosen === null ? EMPTY_BENCH : HANDY).map((name) => (
          <PageLink key={name} name={name} short />
        ))}
      </nav>
    </div>
  )
}

function Pages() {
  const t = useT()
  const known = useDrives()
  const drives = known ?? []
  const drive = useChosen()
  const hasIo = useHasIo(drive)
  const canTune = useCanTune(drive)
  // What the axis has not stays in its place: the entries below would move under a finger, each
  // time another axis is chosen. The page states why there is nothing.
  const has = (name: Page) =>
    name === 'io' ? hasIo : name === 'tune' || name === 'response' ? canTune : true
  return (
    // The list of axes pushes the pages away when it comes.
    <div className={known === null ? 'arriving' : 'arrived'}>
      <h2>{t('frame.axes')}</h2>
      <div className={drives.length > FEW_AXES ? 'axes many' : 'axes'}>
        {drives.map((each) => (
          <AxisEntry key={each.id} id={each.id} />
        ))}
      </div>
      {drives.length === 0 && <p className="dim">{t('frame.noAxes')}</p>}
      <h2>{t('frame.axisPages')}</h2>
      {AXIS_PAGES.map((name) => (
        <PageLink key={name} name={name} faint={drive !== null && !has(name)} />
      ))}
      <h2>{t('frame.bench')}</h2>
      {BENCH_PAGES.map((name) => (
        <PageLink key={name} name={name} />
      ))}
    </div>
  )
}

function AxisEntry({ id }: { id: string }) {
  const { drive } = useRoute()
  const summary = useDrive(id)
  const state = useAxisState(id)
  const t = useT()
  const look = stateLook(state)
  const entry = useRef<HTMLButtonElement>(null)
  const chosen = drive === id
  useEffect(() => {
    if (chosen) entry.current?.scrollIntoView({ block: 'nearest' })
  }, [chosen])
  if (!summary) return null
  const words = state?.fresh ? known(t, 'state', state.state) : t('state.noAnswer')
  return (
    <button
      ref={entry}
      type="button"
      className="entry axis-entry"
      title={`${summary.name}: ${words}`}
      aria-current={chosen ? 'true' : undefined}
      onClick={() => chooseDrive(id)}
    >
      <span className={`dot ${look.tone}`}>
        <Icon name={look.icon} size={14} />
      </span>
      <span className="grow">
        {summary.name}
        <small>{words}</small>
      </span>
    </button>
  )
}

function PageLink({
  name,
  short = false,
  faint = false,
}: {
  name: Page
  short?: boolean
  faint?: boolean
}) {
  const t = useT()
  const { page, drive } = useRoute()
  const drives = useDrives() ?? []
  const target = drive ?? drives[0]?.id ?? null
  const state = useAxisState(target)
  const dead = isAxisPage(name) && target === null
  const count = name === 'alarms' ? (state?.faults.length ?? 0) : 0
  if (dead && short) return null
  return dead ? (
    <span className="entry off" aria-disabled="true">
      <Icon name={name} /> {t(`page.${name}`)}
    </span>
  ) : (
    <a
      className={faint ? 'entry faint' : 'entry'}
      href={href(name, target)}
      aria-current={page === name ? 'page' : undefined}
    >
      <Icon name={name} size={short ? 22 : 18} /> <span>{t(`page.${name}`)}</span>
      {count > 0 && <b className="count">{count}</b>}
      {name === 'scope' && page !== 'scope' && <ScopeMark />}
    </a>
  )
}

/** The scope's trigger is sought while other pages are open, too. */
function ScopeMark() {
  const t = useT()
  const trigger = useStore('trigger', () => contents.trigger)
  if (trigger === 'off') return null
  const words = t(`frame.scope.${trigger}`)
  return (
    <b className={`count scope-mark ${trigger}`} role="img" aria-label={words} title={words}>
      {trigger === 'triggered' ? '✓' : '…'}
    </b>
  )
}

function AxisPicker() {
  const t = useT()
  const drives = useDrives() ?? []
  const { drive } = useRoute()
  const chosen = drive ?? drives[0]?.id ?? ''
  return (
    <NativeSelect
      className="picker"
      aria-label={t('frame.axis')}
      value={chosen}
      disabled={drives.length === 0}
      onChange={(event) => chooseDrive(event.currentTarget.value)}
      data={
        drives.length === 0
          ? [{ value: '', label: t('frame.noAxis') }]
          : drives.map((each) => ({ value: each.id, label: each.name }))
      }
    />
  )
}

function useChosen(): string | null {
  const drives = useDrives() ?? []
  return useRoute().drive ?? drives[0]?.id ?? null
}

function StateBadge() {
  const t = useT()
  const id = useChosen()
  const state = useAxisState(id)
  const look = stateLook(state)
  return (
    <span className={`badge ${look.tone}`} role="status" aria-label={t('frame.state')}>
      <Icon name={look.icon} size={16} />
      <span>
        {id && state?.fresh ? (
          <StateName state={state.state} below />
        ) : (
          t(!id ? 'frame.noAxis' : state ? 'state.noAnswer' : 'state.unknown')
        )}
      </span>
    </span>
  )
}

function LinkBadge() {
  const t = useT()
  const drive = useDrive(useChosen())
  const look = linkLook(drive?.quality ?? null)
  if (!drive) return null
  const trip = drive.quality.round_trip_ms
  return (
    <a
      className={`badge plain-badge ${look.tone}-text`}
      href="#/connect"
      title={t('frame.linkHelp')}
    >
      <Icon name="link" size={16} />
      <span>
        <span className="long">{t(`link.${look.word}`)}</span>
        <span className="short">{t(`link.short.${look.word}`)}</span>
        {trip !== null && look.word !== 'lost' && (
          <small className="num wide-only"> {trip.toFixed(1)} ms</small>
        )}
      </span>
    </a>
  )
}

function ConnectionLost() {
  const t = useT()
  const link = useLink()
  if (link.open) return null
  return (
    <div className={`banner ${contents.everOpen ? 'fault' : 'ready'}`} role="alert">
      <strong>{t(contents.everOpen ? 'lost.title' : 'lost.opening')}</strong>{' '}
      {contents.lostAt !== null &&
        t('lost.text', { attempt: link.attempt, time: clock(contents.lostAt) })}
    </div>
  )
}

const REFUSED_MS = 12000

/** A request over the websocket that the server turned down, with what to try. */
function Refused() {
  const t = useT()
  const say = useSay()
  const refused = useStore('refused', () => contents.refused)
  const [seen, setSeen] = useState(0)
  useEffect(() => {
    if (!refused) return
    const timer = setTimeout(() => setSeen(refused.at), REFUSED_MS)
    return () => clearTimeout(timer)
  }, [refused])
  // What STOP did not reach is in its own report, with the other axes.
  const reported = useStore('stop', currentReport)?.answer != null
  if (!refused || refused.at <= seen || (refused.request === 'stop' && reported)) return null
  return (
    <div className="note fault" role="alert">
      <p>
        <strong>{problemTitle(t, refused.problem)}</strong> {say.detail(refused.problem)}
      </p>
      {refused.problem.remedy && (
        <p>
          {t('problem.try')} {say.remedy(refused.problem)}
        </p>
      )}
      <button type="button" className="plain" onClick={() => setSeen(refused.at)}>
        {t('close')}
      </button>
    </div>
  )
}
