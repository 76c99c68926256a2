import { useEffect, useRef } from 'react'

const TYPING_MS = 150

/**
 * Ask when a page opens, at once, so that the page is not shown before its answer; then, each time
 * that `load` becomes another, when typing has paused.
 */
export function useSearch(load: () => Promise<void>, open: boolean): void {
  const asked = useRef(false)
  useEffect(() => {
    if (!open) return
    if (!asked.current) {
      asked.current = true
      void load()
      return
    }
    const timer = setTimeout(() => void load(), TYPING_MS)
    return () => clearTimeout(timer)
  }, [open, load])
}
