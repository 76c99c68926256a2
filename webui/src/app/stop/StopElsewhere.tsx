import { useEffect, useState } from 'react'
import { createPortal } from 'react-dom'
import { useT } from '../../i18n'
import { contents, subscribe } from '../../live/store'
import { pressedAt } from './stop'

/** How long after one's own STOP the server's log reports that one. */
const OWN_MS = 4000
const SHOWN_MS = 20_000

/**
 * Somebody else pressed STOP: an axis that stands for no visible reason must not be started again.
 */
export function StopElsewhere() {
  const t = useT()
  const [by, setBy] = useState<{ person: string } | null>(null)
  useEffect(
    () =>
      subscribe('log', () => {
        const last = contents.log.at(-1)
        if (last?.message.code !== 'station.stop-pressed' || Date.now() - pressedAt() < OWN_MS)
          return
        setBy({ person: last.person })
      }),
    [],
  )
  useEffect(() => {
    if (!by) return
    const timer = setTimeout(() => setBy(null), SHOWN_MS)
    return () => clearTimeout(timer)
  }, [by])
  if (!by) return null
  return createPortal(
    <div className="stop-report" role="alert">
      <p>
        <strong>{t('stop.byOther', { person: by.person || t('stop.somebody') })}</strong>
      </p>
      <p>{t('stop.askFirst')}</p>
      <button type="button" className="plain" onClick={() => setBy(null)}>
        {t('close')}
      </button>
    </div>,
    document.body,
  )
}
