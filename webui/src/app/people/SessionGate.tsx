import { type ReactNode, useEffect } from 'react'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { GUEST, Join, LogIn, SetUp } from './LogInForms'
import { Preferences } from '../Preferences'
import { StopButton } from '../stop/StopButton'
import { askSession, mayHaveStop, useSession } from './session'

const RETRY_MS = 2000

/** The page behind it is for somebody whom the server knows. */
export function SessionGate({ children }: { children: ReactNode }) {
  const session = useSession()
  const t = useT()
  const known = session?.person != null
  useEffect(() => {
    if (session !== null) return
    const ask = () => void askSession().catch(() => {})
    ask()
    const timer = setInterval(ask, RETRY_MS)
    return () => clearInterval(timer)
  }, [session])
  useEffect(() => {
    if (known) live.start()
  }, [known])
  if (session === null) {
    return (
      <main className="login">
        <p role="status">{t('lost.opening')}</p>
      </main>
    )
  }
  if (known) return <>{children}</>
  const link = GUEST.exec(window.location.hash)?.[1]
  return (
    <main className="login">
      {mayHaveStop() && <StopButton />}
      <div className="login-head">
        <h1>servodeck</h1>
        <Preferences />
      </div>
      {link ? <Join link={link} /> : session.setup_required ? <SetUp /> : <LogIn />}
    </main>
  )
}
