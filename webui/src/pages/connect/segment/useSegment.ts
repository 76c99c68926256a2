import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { EthercatSegment } from '../../../api/schema'
import { useLink } from '../../../live/store'

const PERIOD_MS = 2000

/** A segment as it is, asked for again and again; the next question waits for the answer. */
export function useSegment(url: string): {
  segment: EthercatSegment | null
  refresh: () => Promise<void>
} {
  const { open } = useLink()
  const [segment, setSegment] = useState<EthercatSegment | null>(null)
  const refresh = useCallback(async () => {
    try {
      setSegment(await ask(api.GET('/api/v1/ethercat/segment', { params: { query: { url } } })))
    } catch {
      // Shown by the connection banner; the next round tries again.
    }
  }, [url])
  useEffect(() => {
    if (!open) return
    let timer: ReturnType<typeof setTimeout> | undefined
    let ended = false
    const round = async () => {
      await refresh()
      if (!ended) timer = setTimeout(() => void round(), PERIOD_MS)
    }
    void round()
    return () => {
      ended = true
      clearTimeout(timer)
    }
  }, [open, refresh])
  return { segment, refresh }
}
