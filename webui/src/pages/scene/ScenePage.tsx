import { useEffect } from 'react'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { contents, useDrives, useLink } from '../../live/store'
import { Panel } from '../../widgets/layout/Panel'
import './scene.css'
import { SceneFrame } from './SceneFrame'
import { WhatItDrives } from './WhatItDrives'

/** All axes in 3D, moving with their live positions. */
export function ScenePage() {
  const t = useT()
  const { open } = useLink()
  const drives = useDrives() ?? []
  const ids = drives.map((drive) => drive.id).join(' ')
  useEffect(() => {
    if (!open) return
    for (const id of ids.split(' ')) {
      if (id && !contents.rows.has(id)) void live.loadRows(id).catch(() => {})
    }
  }, [open, ids])
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
