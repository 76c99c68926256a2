import { api, ask, setCsrf } from '../../api/client'
import type { Session } from '../../api/schema'
import { publish, useStore } from '../../live/store'
import * as browser from '../../widgets/browser/kept'

/** Who this page is for; null until the server has said. */
let session: Session | null = null
let asking = false

/** A flag of the browser's tab: somebody was logged in, so STOP may still be theirs. */
const WAS_IN = 'servodeck.wasIn'
let wasIn = false

export const currentSession = () => session
export const useSession = () => useStore('session', currentSession)
/** True also where the browser keeps no such flag and somebody has been logged in since. */
export const mayHaveStop = () => wasIn || browser.kept(WAS_IN, 'sessionStorage') !== null

export function keep(next: Session): void {
  session = next
  setCsrf(next.csrf ?? null)
  if (next.person !== null) {
    wasIn = true
    browser.keep(WAS_IN, '1', 'sessionStorage')
  }
  publish('session')
}

/** Ask who we are. Keeps what was known where there is no answer. */
export async function askSession(): Promise<void> {
  if (asking) return
  asking = true
  try {
    keep(await ask(api.GET('/api/v1/session')))
  } finally {
    asking = false
  }
}

/** The server may have ended the session: then everything shown belongs to nobody. */
export async function checkSession(): Promise<void> {
  const before = session?.person ?? null
  try {
    await askSession()
  } catch {
    return // no connection at all; its banner says so
  }
  if (before !== null && session?.person !== before) window.location.reload()
}

export async function leave(): Promise<void> {
  await ask(api.DELETE('/api/v1/session'))
  wasIn = false
  browser.keep(WAS_IN, null, 'sessionStorage')
  window.location.reload()
}

export const hasRight = (right: string) => session?.rights.some((each) => each === right) ?? false
