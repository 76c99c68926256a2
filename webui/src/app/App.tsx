import { MantineProvider } from '@mantine/core'
import { Component, type ReactNode, useEffect } from 'react'
import { useT } from '../i18n'
import * as live from '../live/live'
import { contents, useDrives, useLink } from '../live/store'
import { AlarmsPage } from '../pages/alarms/AlarmsPage'
import { AuditPage } from '../pages/audit/AuditPage'
import { ConnectPage } from '../pages/connect/ConnectPage'
import { FilesPage } from '../pages/files/FilesPage'
import { GainsPage } from '../pages/gains/GainsPage'
import { IoPage } from '../pages/io/IoPage'
import { MotionPage } from '../pages/motion/MotionPage'
import { OverviewPage } from '../pages/overview/OverviewPage'
import { ParametersPage } from '../pages/parameters/ParametersPage'
import { PeoplePage } from '../pages/people/PeoplePage'
import { RerunPage } from '../pages/rerun/RerunPage'
import { ScenePage } from '../pages/scene/ScenePage'
import { ResponsePage } from '../pages/response/ResponsePage'
import { ScopePage } from '../pages/scope/ScopePage'
import { SetupPage } from '../pages/setup/SetupPage'
import { TunePage } from '../pages/tune/TunePage'
import { Frame } from './Frame'
import { isAxisPage, useRoute } from './router'
import { SessionGate } from './SessionGate'
import { theme } from './theme'

export function App() {
  return (
    <MantineProvider theme={theme} defaultColorScheme="auto">
      <SessionGate>
        <Frame>
          <Page />
        </Frame>
      </SessionGate>
    </MantineProvider>
  )
}

const AXIS = {
  overview: OverviewPage,
  parameters: ParametersPage,
  motion: MotionPage,
  tune: TunePage,
  response: ResponsePage,
  gains: GainsPage,
  setup: SetupPage,
  io: IoPage,
  alarms: AlarmsPage,
}
const BENCH = {
  connect: ConnectPage,
  scope: ScopePage,
  rerun: RerunPage,
  scene: ScenePage,
  files: FilesPage,
  audit: AuditPage,
  people: PeoplePage,
}

function Page() {
  const t = useT()
  const { page, drive } = useRoute()
  const drives = useDrives()
  const { open } = useLink()
  useEffect(() => {
    // The descriptions tell which pages an axis has; they do not change while it is connected.
    if (open && drive && drives?.some((each) => each.id === drive) && !contents.rows.has(drive)) {
      void live.loadRows(drive).catch(() => {})
    }
  }, [drive, drives, open])
  if (!isAxisPage(page)) {
    const Shown = BENCH[page]
    return (
      <Guard key={page}>
        <Shown />
      </Guard>
    )
  }
  if (drives === null) return <p className="empty">{t('loading')}</p>
  if (drive === null || !drives.some((each) => each.id === drive)) {
    return (
      <div className="page">
        <p className="empty">
          {t('frame.noSuchAxis')} <a href="#/connect">{t('page.connect')}</a>
        </p>
      </div>
    )
  }
  const Shown = AXIS[page]
  return (
    <Guard key={`${page} ${drive}`}>
      <Shown drive={drive} />
    </Guard>
  )
}

/** A defect in one page must not take STOP away with it. */
class Guard extends Component<{ children: ReactNode }, { error: Error | null }> {
  override state = { error: null as Error | null }

  static getDerivedStateFromError(error: Error) {
    return { error }
  }

  override render() {
    return this.state.error ? <Broken error={this.state.error} /> : this.props.children
  }
}

function Broken({ error }: { error: Error }) {
  const t = useT()
  return (
    <div className="page">
      <div className="note fault" role="alert">
        <p>
          <strong>{t('broken.title')}</strong> {error.message}
        </p>
        <p>{t('broken.text')}</p>
      </div>
    </div>
  )
}
