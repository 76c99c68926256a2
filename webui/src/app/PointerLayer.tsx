import { useEffect, useState } from 'react'
import * as live from '../live/live'
import { usePeople, usePointers } from '../live/people'

const SEND_MS = 80

/** This page's place, as the others are told. */
const here = () => window.location.hash.replace(/^#/, '')

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
  const main = document.getElementById('main')
  if (!shared || !main) return null
  return (
    <div className="pointers" aria-hidden="true">
      {[...pointers.values()]
        .filter((each) => each.x !== null && each.y !== null && each.page === page)
        .map((each) => (
          <span
            key={each.connection}
            className="pointer"
            style={{
              left: (each.x ?? 0) * main.scrollWidth - main.scrollLeft + main.offsetLeft,
              top: (each.y ?? 0) * main.scrollHeight - main.scrollTop + main.offsetTop,
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
    const main = document.getElementById('main')
    if (!main) return
    const box = main.getBoundingClientRect()
    const share = (value: number, whole: number) => Math.min(1, Math.max(0, value / whole))
    next = {
      x: share(event.clientX - box.left + main.scrollLeft, main.scrollWidth),
      y: share(event.clientY - box.top + main.scrollTop, main.scrollHeight),
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
