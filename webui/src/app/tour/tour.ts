import { useEffect } from 'react'
import { api, ask } from '../../api/client'
import { publish, useStore } from '../../live/store'
import { type Place, storedPlace, storePlace } from './steps'

/** Whether this station is a demo with a tour; null until it is known. */
let offered: boolean | null = null
let asking = false
let place: Place = storedPlace()

async function look(): Promise<void> {
  if (asking || offered !== null) return
  asking = true
  try {
    offered = (await ask(api.GET('/api/v1/health'))).tour
    publish('tour')
  } catch {
    // Without an answer there is no tour; the next connection asks again.
  } finally {
    asking = false
  }
}

/** Whether this station is a demo with a tour. `open`: there is a connection to ask. */
export function useHasTour(open: boolean): boolean {
  useEffect(() => {
    if (open) void look()
  }, [open])
  return useStore('tour', () => offered) ?? false
}

/** Where the tour is. */
export const usePlace = (): Place => useStore('tour', () => place)

export function setPlace(next: Place): void {
  place = next
  storePlace(next)
  publish('tour')
}
