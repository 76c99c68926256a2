import { type ReactNode, useEffect, useLayoutEffect, useRef } from 'react'
import { settled } from './settle'

/**
 * What somebody must be informed at once, whatever page is open. It stands above the page, also of
 * one that is scrolled, and coming or going it moves nothing: the page is scrolled by its height,
 * and what it lies over is reached by scrolling up. `page` names what is open.
 */
export function Late({ page, children }: { page: string; children: ReactNode }) {
  const reported = useRef<HTMLDivElement>(null)
  const room = useRef({ height: 0, left: 0, scrolled: 0 })
  const opened = useRef('')
  useLayoutEffect(() => {
    // Each page from its top, not from where the one before it was left.
    const main = reported.current?.parentElement
    if (!main || !reported.current || opened.current === page) return
    opened.current = page
    reported.current.style.marginBottom = ''
    main.scrollTo(0, 0)
    room.current.left = 0
    room.current.scrolled = 0
  }, [page])
  useEffect(() => {
    const box = reported.current
    const main = box?.parentElement
    if (!box || !main) return
    const kept = room.current
    const scrolled = () => {
      // What the browser scrolls as a notice comes or goes may be reported before its new height.
      if (box.offsetHeight === kept.height) kept.scrolled = main.scrollTop
    }
    const resized = () => {
      const height = box.offsetHeight
      if (height === kept.height) return
      const before = kept.height
      kept.height = height
      // A page that is only being built has nothing yet that could move.
      if (!main.querySelector(':scope > .room > .arrived')) return
      const anchored = main.scrollTop - kept.scrolled
      const was = { scrolled: main.scrollTop, left: kept.left }
      const now = settled(was, before, height, anchored)
      kept.left = now.left
      box.style.marginBottom = now.left > 0 ? `${now.left}px` : ''
      main.scrollTop = now.scrolled
      kept.scrolled = main.scrollTop
    }
    const observer = new ResizeObserver(resized)
    observer.observe(box)
    // Before the next event: a press that is used before the page is drawn again would otherwise
    // meet what has moved under it, which nobody has seen yet.
    const changed = new MutationObserver(resized)
    changed.observe(box, { childList: true, subtree: true, characterData: true, attributes: true })
    main.addEventListener('scroll', scrolled, { passive: true })
    return () => {
      observer.disconnect()
      changed.disconnect()
      main.removeEventListener('scroll', scrolled)
    }
  }, [])
  return (
    <div className="late" ref={reported}>
      {children}
    </div>
  )
}
