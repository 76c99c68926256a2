import { type ReactNode, useEffect, useState } from 'react'
import { moment, outstanding } from '../../api/outstanding'
import { useT } from '../../i18n'
import { contents } from '../../live/store'
import './arriving.css'
import type { Page } from '../navigation/router'

/** Looked at so often; a question that follows from an answer is asked within two looks. */
const LOOK_MS = 30
const QUIET_LOOKS = 2
/**
 * A page whose drive or network lets it wait longer shows what it has. What is wrong with a drive
 * stands first on its page, so that nothing moves it, and must not wait for a drive that is dead;
 * nor need any page wait long without a connection, or for a drive that is mute.
 */
const LONGEST_MS = 3000
const SHORT_MS = 1000

/**
 * A page is built out of sight until what it asked for on opening is there: parts that come
 * later would push away what a finger is on its way to, on a page that moves metal.
 */
export function Arriving({
  page,
  drive,
  children,
}: {
  page: Page
  drive: string | null
  children: ReactNode
}) {
  const t = useT()
  // Taken before the page's own effects ask for anything.
  const [since] = useState(moment)
  const [there, setThere] = useState(false)
  useEffect(() => {
    if (there) return
    const begun = performance.now()
    let quiet = 0
    const timer = setInterval(() => {
      const state = drive === null ? undefined : contents.states.get(drive)
      const silent = contents.lostAt !== null || state?.fresh === false
      const longest = silent || page === 'alarms' ? SHORT_MS : LONGEST_MS
      const waits = !contents.link.open || (drive !== null && !state) || outstanding(since)
      quiet = waits ? 0 : quiet + 1
      if (quiet >= QUIET_LOOKS || performance.now() - begun > longest) setThere(true)
    }, LOOK_MS)
    return () => clearInterval(timer)
  }, [there, since, drive, page])
  return (
    <>
      {!there && (
        <p className="empty arriving-note" role="status">
          {t('loading')}
        </p>
      )}
      <div className={there ? 'arrived' : 'arriving'}>{children}</div>
    </>
  )
}
