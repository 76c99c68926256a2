import { Button } from '@mantine/core'
import { useState } from 'react'
import { href } from '../../app/navigation/router'
import { useHasTour } from '../../app/tour/tour'
import { useT } from '../../i18n'
import { useLink } from '../../live/store'
import { keep, kept } from '../../widgets/browser/kept'
import { Panel } from '../../widgets/layout/Panel'
import '../scene/scene.css'
import { SceneFrame } from '../scene/SceneFrame'

const SHOWN = 'servodeck.overview.scene'

/**
 * The axis in 3D. It is drawn only where it was asked for, and stays so in this browser: a tablet
 * without WebGL, or one on a slow line, is not made to carry it.
 */
export function SceneHere({ drive }: { drive: string }) {
  const t = useT()
  const demo = useHasTour(useLink().open)
  const [chosen, setChosen] = useState(() => kept(SHOWN))
  // The demo shows its load from the start; the computer that draws it is the one that serves it.
  const shown = chosen === null ? demo : chosen === '1'
  const toggle = () => {
    const next = shown ? '0' : '1'
    keep(SHOWN, next)
    setChosen(next)
  }
  return (
    <Panel
      title={t('scene.axis')}
      tools={
        <>
          <Button component="a" href={href('scene', drive)}>
            {t('scene.all')}
          </Button>
          <Button aria-expanded={shown} onClick={toggle}>
            {t(shown ? 'scene.hide' : 'scene.show')}
          </Button>
        </>
      }
    >
      {shown ? (
        <SceneFrame axis={drive} className="small" />
      ) : (
        <p className="dim">{t('scene.closed')}</p>
      )}
    </Panel>
  )
}
