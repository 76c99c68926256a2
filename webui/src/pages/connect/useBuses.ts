import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Bus } from '../../api/schema'
import { useLink } from '../../live/store'

const PERIOD_MS = 2000

/** Opened buses with their counters, asked for again and again. */
export function useBuses(): { buses: Bus[]; refresh: () => Promise<void> } {
  const { open } = useLink()
  const [buses, setBuses] = useState<Bus[]>([])
  const refresh = useCallback(async () => {
    try {
      setBuses(await ask(api.GET('/api/v1/buses')))
    } catch {
      // Shown by the connection banner; the next round tries again.
    }
  }, [])
  useEffect(() => {
    if (!open) return
    void refresh()
    const timer = setInterval(() => void refresh(), PERIOD_MS)
    return () => clearInterval(timer)
  }, [open, refresh])
  return { buses, refresh }
}
