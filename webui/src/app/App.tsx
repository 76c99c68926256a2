import { MantineProvider } from '@mantine/core'
import { Component, type ReactNode, Suspense, useEffect, useMemo } from 'react'
import { useT } from '../i18n'
import * as live from '../live/live'
import { contents, useDrives, useLink } from '../live/store'
import { Arriving } from './notes/Arriving'
import { Frame } from './Frame'
import { AXIS, BENCH, fetchAhead } from './navigation/pages'
import { isAxisPage, useRoute } from './navigation/router'
import { SessionGate } from './people/SessionGate'
import { StopButton } from './stop/StopButton'
import { themeWith } from './styles/theme'

export function App() {
  const t = useT()
  const reported = useMemo(() => themeWith(t('close')), [t])
  return (
    <MantineProvider theme={reported} defaultColorScheme="auto">
      <SessionGate>
        <Guard stop>
          <Frame>
            <Page />
          </Frame>
        </Guard>
      </SessionGate>
    </MantineProvider>
  )
}

function Page() {
  const t = useT()
  const { page, drive } = useRoute()
  const drives = useDrives()
  const { open } = useLink()
  const chosen = drive ?? drives?.[0]?.id ?? null
  const there = drives?.some((each) => each.id === chosen) ?? false
  useEffect(() => {
    // The descriptions show which pages an axis has; they do not change while it is connected.
    if (open && chosen && there && !contents.rows.has(chosen)) {
      void live.loadRows(chosen).catch(() => {})
    }
  }, [chosen, there, open])
  useEffect(() => {
    if (open) fetchAhead()
  }, [open])
  if (!isAxisPage(page)) {
    const Shown = BENCH[page]
    return (
      <Guard key={page}>
        <Arriving page={page} drive={null}>
          <Shown />
        </Arriving>
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
      <Arriving page={page} drive={drive}>
        <Shown drive={drive} />
      </Arriving>
    </Guard>
  )
}

/** A defect in one page must not take STOP away with it. */
class Guard extends Component<{ children: ReactNode; stop?: boolean }, { error: Error | null }> {
  override state = { error: null as Error | null }

  static getDerivedStateFromError(error: Error) {
    return { error }
  }

  override render() {
    return this.state.error ? (
      <>
        {this.props.stop && <StopButton />}
        <Broken error={this.state.error} />
      </>
    ) : (
      <Suspense fallback={<Loading />}>{this.props.children}</Suspense>
    )
  }
}

function Loading() {
  const t = useT()
  const { open } = useLink()
  return (
    <p className="empty" role="status">
      {t(open ? 'loading' : 'loading.later')}
    </p>
  )
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
        <button type="button" className="plain" onClick={() => window.location.reload()}>
          {t('broken.reload')}
        </button>
      </div>
    </div>
  )
}
