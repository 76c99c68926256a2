import { useEffect, useState } from 'react'
import * as live from '../../live/live'
import { usePeople, usePointers } from '../../live/people'

const SEND_MS = 80

/** This page's place, as the others are informed. */
const here = () => window.location.hash.replace(/^#/, '')

/**
 * Where the content of a page lies in the window, px: what a pointer's place is counted in. What is
 * reported above the content is everybody's own, so its height does not count.
 */
function content(): { left: number; top: number; width: number; height: number } | null {
  const main = document.getElementById('main')
  const room = main?.querySelector(':scope > .room')
  if (!main || !room) return null
  const { left, top, width, height } = room.getBoundingClientRect()
  return { left, top, width, height: Math.max(height, main.clientHeight) }
}

/** Pointers of others on the same page, and telling them of this one, while a guest is here. */
export function PointerLayer() {
  const people = usePeople()
  const pointers = usePointers()
  const [page, setPage] = useState(here)
  const shared = people?.invitations.some((each) => each.state === 'joined') ?? false
  useEffect(() => {
    const tell = () => {
      setPage(here())
      // The secret of an invitation's link is nobody's business.
      if (!here().startsWith('/guest/')) live.stand('where', { type: 'where', page: here() })
    }
    tell()
    window.addEventListener('hashchange', tell)
    return () => window.removeEventListener('hashchange', tell)
  }, [])
  useEffect(() => (shared ? follow() : undefined), [shared])
  const box = shared ? content() : null
  if (!box) return null
  return (
    <div className="pointers" aria-hidden="true">
      {[...pointers.values()]
        .filter((each) => each.x !== null && each.y !== null && each.page === page)
        .map((each) => (
          <span
            key={each.connection}
            className="pointer"
            style={{
              left: box.left + (each.x ?? 0) * box.width,
              top: box.top + (each.y ?? 0) * box.height,
            }}
          >
            {each.person}
          </span>
        ))}
    </div>
  )
}

/** Send the pointer's place in the content, at most every SEND_MS. */
function follow(): () => void {
  let next: { x: number; y: number } | null = null
  let sent: string | null = null
  const move = (event: PointerEvent) => {
    const box = content()
    if (!box) return
    const share = (value: number, whole: number) => Math.min(1, Math.max(0, value / whole))
    next = {
      x: share(event.clientX - box.left, box.width),
      y: share(event.clientY - box.top, box.height),
    }
  }
  const gone = () => (next = null)
  const timer = setInterval(() => {
    const key = JSON.stringify(next)
    if (key === sent) return
    sent = key
    live.send({ type: 'pointer', x: next?.x ?? null, y: next?.y ?? null })
  }, SEND_MS)
  window.addEventListener('pointermove', move, { passive: true })
  document.addEventListener('pointerleave', gone)
  return () => {
    clearInterval(timer)
    window.removeEventListener('pointermove', move)
    document.removeEventListener('pointerleave', gone)
    live.send({ type: 'pointer', x: null, y: null })
  }
}
