import { useEffect, useRef, useState } from 'react'
import { api, ask } from '../../api/client'
import type { AxisRecordInfo, DriveSummary } from '../../api/schema'
import { href } from '../../app/router'
import { stopEverything } from '../../app/stop'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { Panel } from '../../widgets/Panel'

/** All axes in 3D, moving with their live positions. */
export function ScenePage() {
  const t = useT()
  const drives = useDrives() ?? []
  return (
    <div className="page">
      <h1>{t('page.scene')}</h1>
      <Panel title={t('scene.frame')}>
        {drives.length === 0 ? <p className="dim">{t('scene.none')}</p> : <SceneFrame />}
        <p className="dim">{t('scene.help')}</p>
        {drives.map((drive) => (
          <WhatItDrives key={drive.id} drive={drive} />
        ))}
      </Panel>
    </div>
  )
}

/** viser's page in a frame of our origin. */
function SceneFrame() {
  const t = useT()
  const frame = useRef<HTMLIFrameElement>(null)
  return (
    <iframe
      ref={frame}
      className="viewer"
      title={t('scene.frame')}
      src="/viser/"
      onLoad={() => {
        // Keys pressed in the frame do not come to the page; Esc must stop from there too.
        frame.current?.contentWindow?.addEventListener(
          'keydown',
          (event) => {
            if (event.key === 'Escape' && !event.repeat) void stopEverything()
          },
          { capture: true },
        )
      }}
    />
  )
}

function WhatItDrives({ drive }: { drive: DriveSummary }) {
  const t = useT()
  const [record, setRecord] = useState<AxisRecordInfo | null>(null)
  useEffect(() => {
    let current = true
    ask(
      api.GET('/api/v1/drives/{drive_id}/record', { params: { path: { drive_id: drive.id } } }),
    ).then(
      (found) => current && setRecord(found),
      () => current && setRecord(null),
    )
    return () => {
      current = false
    }
  }, [drive.id])
  const kind = record?.mechanics?.kind ?? 'shaft'
  return (
    <p className="row">
      <strong>{drive.name}</strong> {t('scene.drives', { what: t(`scene.${kind}`) })}
      <a href={href('motion', drive.id)}>{t('scene.set')}</a>
    </p>
  )
}
