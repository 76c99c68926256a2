import { useCallback, useRef, useState } from 'react'
import { api, ask, problemOf } from '../../../api/client'
import type { LibraryEntry, LibraryPage, MessageInfo, Problem, TagCount } from '../../../api/schema'
import { useLink } from '../../../live/store'
import { useSearch } from '../../../widgets/requests/useSearch'
import { type Filters, queryOf } from './filters'

const PAGE = 50
/** The server gives at most this many at once. */
const LARGEST = 500

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
      const known = new Map<number, LibraryEntry>()
      let page: LibraryPage
      let offset = 0
      do {
        const query = { ...queryOf(wanted, Math.min(LARGEST, most - offset)), offset }
        page = await ask(api.GET('/api/v1/library', { params: { query } }))
        if (overtaken()) return
        // One that was stored meanwhile moves the others on: none is listed twice.
        for (const entry of page.entries) known.set(entry.id, entry)
        offset += LARGEST
      } while (offset < most && offset < page.total)
      setEntries([...known.values()])
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
  const more = () => setLimit((before) => before + PAGE)
  return { entries, total, tags, problems, messages, shared, problem, refresh, more }
}
