import { useComputedColorScheme } from '@mantine/core'
import { useRef } from 'react'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { stopByEscapeIn } from '../../widgets/frame-stop'

/** Distance of two axes in the scene, as backend/scene/view.py places them (_SPACING). */
const SPACING = 0.9

/**
 * viser's page in a frame of our origin, in the page's own light. With `axis` the camera begins
 * before that one.
 */
export function SceneFrame({ axis, className = '' }: { axis?: string; className?: string }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const drives = useDrives() ?? []
  const frame = useRef<HTMLIFrameElement>(null)
  const query = new URLSearchParams()
  if (dark) query.set('darkMode', '')
  const place = drives.findIndex((each) => each.id === axis)
  if (place >= 0) {
    const y = (drives.length / 2 - 0.5 - place) * SPACING
    query.set('initialCameraPosition', `-0.2,${(y - 1.2).toFixed(3)},0.95`)
    query.set('initialCameraLookAt', `-0.2,${y.toFixed(3)},0.1`)
  }
  return (
    <iframe
      ref={frame}
      className={`viewer ${className}`}
      title={t('scene.frame')}
      src={`/viser/?${query}`}
      onLoad={() => stopByEscapeIn(frame.current)}
    />
  )
}
