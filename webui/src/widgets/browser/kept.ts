/**
 * What this browser keeps for the page. A browser may refuse that (blocked cookies, a full disk,
 * private windows); the page then works as well, and forgets.
 */
type Place = 'localStorage' | 'sessionStorage'

export function kept(key: string, where: Place = 'localStorage'): string | null {
  try {
    return globalThis[where]?.getItem(key) ?? null
  } catch {
    return null
  }
}

/** Keep a text; null removes it. */
export function keep(key: string, text: string | null, where: Place = 'localStorage'): void {
  try {
    if (text === null) globalThis[where]?.removeItem(key)
    else globalThis[where]?.setItem(key, text)
  } catch {
    // Refused: what was chosen holds until the page is closed.
  }
}
