/** How far the clock of this computer is ahead of the server's; null before it is known. */
let ahead: number | null = null

/**
 * The server has stated its time, in what arrives now. It was on its way for a while, which makes
 * this computer seem ahead: the least difference is nearest to the true one.
 */
export function heardServerTime(text: string): void {
  const difference = Date.now() - Date.parse(text)
  if (Number.isNaN(difference)) return
  ahead = ahead === null ? difference : Math.min(ahead, difference)
}

/** Another connection: perhaps another clock. */
export function forgetServerClock(): void {
  ahead = null
}

/**
 * Now, by the clock of the server, as times that it states are compared with. Clocks of a bench
 * computer and a tablet differ by minutes, and an old value must not look new for that long.
 */
export const serverNow = (): number => Date.now() - (ahead ?? 0)
