import { useEffect, useState } from 'react'
import { problemOf } from '../../api/client'
import type { Problem } from '../../api/schema'

/**
 * What the server says to something that is being typed: asked `settleMs` after the last change,
 * and an answer to what stood there before is dropped. With `question` null nothing is asked;
 * `without` says what then becomes of the last answer.
 */
export function useAnswer<T>(
  question: (() => Promise<T>) | null,
  settleMs: number,
  changes: unknown[],
  without: 'keep' | 'forget' = 'keep',
): { found: T | null; problem: Problem | null } {
  const [found, setFound] = useState<T | null>(null)
  const [problem, setProblem] = useState<Problem | null>(null)
  useEffect(() => {
    if (!question) {
      if (without === 'forget') setFound(null)
      return
    }
    let current = true
    const timer = setTimeout(() => {
      question().then(
        (made) => {
          if (!current) return
          setFound(made)
          setProblem(null)
        },
        (error: unknown) => {
          if (!current) return
          setFound(null)
          setProblem(problemOf(error))
        },
      )
    }, settleMs)
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, changes)
  return { found, problem }
}
