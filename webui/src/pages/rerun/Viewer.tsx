import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import { useT } from '../../i18n'
import { stopByEscapeIn } from '../../app/stop/frame-stop'
import { LOADING, size, useViewer, viewerUrl } from './viewer'

/** rerun's own viewer in a frame of our origin; `recording` null shows what happens now. */
export function Viewer({ recording }: { recording: string | null }) {
  const t = useT()
  const theme = useComputedColorScheme('dark')
  const frame = useRef<HTMLIFrameElement>(null)
  const [state, setState] = useViewer()
  useEffect(() => setState(LOADING), [recording, setState])
  // The button of a recording is in the list above, often out of sight from here.
  // In braces: what newer browsers return here, React would call as the clean-up of the effect.
  useEffect(() => {
    frame.current?.scrollIntoView({ block: 'nearest' })
  }, [recording])
  const words = {
    loading: t('rerun.loading', { percent: Math.round(state.fraction * 100) }),
    started: t('rerun.started'),
    live: t('rerun.showing', { size: size(state.bytes) }),
    stored: t('rerun.stored', { name: recording ?? '' }),
    lost: t('rerun.lost'),
    broken: t('rerun.broken'),
  }[state.phase]
  return (
    <>
      <p
        className={state.phase === 'broken' ? 'note fault' : 'dim'}
        role="status"
        data-phase={state.phase}
        data-blobs={state.blobs}
      >
        {words} {state.problem}
      </p>
      {state.dropped > 0 && (
        <p className="note warn">{t('rerun.dropped', { count: state.dropped })}</p>
      )}
      <iframe
        ref={frame}
        className="viewer"
        title={t('rerun.title')}
        src={viewerUrl(recording, theme)}
        onLoad={() => stopByEscapeIn(frame.current)}
      />
    </>
  )
}
