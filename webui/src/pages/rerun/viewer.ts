import { useEffect, useState } from 'react'
import { API_ROOT } from '../../api/client'

/** What the viewer's frame shows (backend/records/recording/viewer/viewer.js). */
interface ViewerState {
  phase: 'loading' | 'started' | 'live' | 'stored' | 'lost' | 'broken'
  fraction: number
  bytes: number
  blobs: number
  dropped: number
  problem: string
}

export const LOADING: ViewerState = {
  phase: 'loading',
  fraction: 0,
  bytes: 0,
  blobs: 0,
  dropped: 0,
  problem: '',
}

/** The state of the frame; only messages of our own origin and of the viewer count. */
export function useViewer(): [ViewerState, (state: ViewerState) => void] {
  const [state, setState] = useState(LOADING)
  useEffect(() => {
    const hear = (event: MessageEvent<ViewerState & { source?: string }>) => {
      if (event.origin !== location.origin || event.data.source !== 'servodeck-rerun') return
      setState(event.data)
    }
    window.addEventListener('message', hear)
    return () => window.removeEventListener('message', hear)
  }, [])
  return [state, setState]
}

export function viewerUrl(recording: string | null, theme: string): string {
  const query = new URLSearchParams({ theme })
  if (recording !== null) query.set('recording', recording)
  return `${API_ROOT}/rerun/?${query}`
}

/** Bytes as `12.3 MB`. */
export function size(bytes: number): string {
  const units = ['B', 'kB', 'MB', 'GB', 'TB']
  let step = 0
  while (bytes >= 999.5 && step < units.length - 1) {
    bytes /= 1000
    step++
  }
  return `${step ? bytes.toPrecision(3) : bytes} ${units[step]}`
}
