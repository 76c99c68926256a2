import { useComputedColorScheme } from '@mantine/core'
import { useRef, useState } from 'react'
import { API_ROOT } from '../../api/client'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { stopByEscapeIn } from '../../app/stop/frame-stop'
import { cameraFor, written } from './camera'
import { SceneStates } from './SceneStates'

/**
 * viser's page in a frame of our origin, in the page's own light. With `axis` the camera begins
 * before that one.
 */
export function SceneFrame({ axis, className = '' }: { axis?: string; className?: string }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const drives = useDrives() ?? []
  const frame = useRef<HTMLIFrameElement>(null)
  // Only where it begins: a window that becomes another moves no camera that somebody has turned.
  const [aspect] = useState(() => window.innerWidth / window.innerHeight)
  const place = drives.findIndex((each) => each.id === axis)
  const camera = cameraFor(place, drives.length, aspect)
  const query = new URLSearchParams({
    initialCameraPosition: written(camera.position),
    initialCameraLookAt: written(camera.lookAt),
  })
  if (dark) query.set('darkMode', '')
  return (
    <div className="scene">
      <iframe
        ref={frame}
        className={`viewer ${className}`}
        title={t('scene.frame')}
        src={`${API_ROOT}/viser/?${query}`}
        onLoad={() => stopByEscapeIn(frame.current)}
      />
      <SceneStates {...(axis === undefined ? {} : { axis })} />
    </div>
  )
}
