import { useCallback, useRef, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { LibraryEntry, MessageInfo, Problem, TagCount } from '../../api/schema'
import { useLink } from '../../live/store'
import { useSearch } from '../../widgets/useSearch'
import { type Filters, queryOf } from './filters'

const PAGE = 50

/** What fits the filters, newest first; asked again a moment after a filter changed. */
export function useLibrary(filters: Filters) {
  const { open } = useLink()
  const [entries, setEntries] = useState<LibraryEntry[] | null>(null)
  const [total, setTotal] = useState(0)
  const [tags, setTags] = useState<TagCount[]>([])
  const [problems, setProblems] = useState<string[]>([])
  const [messages, setMessages] = useState<MessageInfo[]>([])
  const [shared, setShared] = useState(false)
  const [problem, setProblem] = useState<Problem | null>(null)
  const [limit, setLimit] = useState(PAGE)
  const key = JSON.stringify([filters, limit])
  const present = useRef(key)
  present.current = key
  const turn = useRef(0)
  const refresh = useCallback(async () => {
    const own = (turn.current += 1)
    const overtaken = () => present.current !== key || turn.current !== own
    const [wanted, most] = JSON.parse(key) as [Filters, number]
    try {
      const query = queryOf(wanted, most)
      const page = await ask(api.GET('/api/v1/library', { params: { query } }))
      if (overtaken()) return
      setEntries(page.entries)
      setTotal(page.total)
      setProblems(page.problems)
      setMessages(page.problem_messages ?? [])
      setShared(page.shared)
      setTags(await ask(api.GET('/api/v1/library/tags')))
      setProblem(null)
    } catch (error) {
      if (!overtaken()) setProblem(problemOf(error))
    }
  }, [key])
  useSearch(refresh, open)
  const more = () => setLimit((before) => Math.min(500, before + PAGE))
  return { entries, total, tags, problems, messages, shared, problem, refresh, more }
}
