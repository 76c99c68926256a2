import { useEffect, useRef, useState } from 'react'
import * as live from '../../../live/live'
import type { QuestionKind, Questions } from '../../../live/worker/worker-messages'

const PERIOD_MS = 300

/** Asks the worker again and again while the picture runs, else once for every new question. */
export function useAnalysis<Kind extends QuestionKind>(
  what: Kind,
  question: () => Questions[Kind]['ask'] | null,
  running: boolean,
  change: string,
): Questions[Kind]['get'] | null {
  const [found, setFound] = useState<Questions[Kind]['get'] | null>(null)
  const latest = useRef(question)
  latest.current = question
  useEffect(() => {
    let alive = true
    let timer: ReturnType<typeof setTimeout> | undefined
    const round = async () => {
      const asked = latest.current()
      if (asked) {
        const answer = await live.askScope(what, asked)
        if (!alive) return
        setFound(answer)
      }
      if (alive && (running || !asked)) timer = setTimeout(() => void round(), PERIOD_MS)
    }
    void round()
    return () => {
      alive = false
      clearTimeout(timer)
    }
  }, [what, running, change])
  return found
}
