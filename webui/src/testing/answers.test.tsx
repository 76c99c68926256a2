// @vitest-environment happy-dom
import { asked, later, serve, settled, shown, type } from './page'
import { fireEvent, renderHook, screen, waitFor } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it } from 'vitest'
import type { DriveSummary, InvitationView, JobInfo } from '../api/schema'
import { SupportBar } from '../app/people/SupportBar'
import { setPeople } from '../live/people'
import { setDrives, setJob, setLink } from '../live/store'
import { ChainCheck } from '../pages/audit/ChainCheck'
import { ALL } from '../pages/audit/filters'
import { useAudit } from '../pages/audit/useAudit'
import { type Filters, NO_FILTERS } from '../pages/files/library/filters'
import { listUrl } from '../pages/files/sets/sets'
import { useLibrary } from '../pages/files/library/useLibrary'
import { Compare } from '../pages/parameters/Compare'
import { ParameterTable } from '../pages/parameters/ParameterTable'
import { MyAccess } from '../pages/people/MyAccess'

const drive = { id: 'x', name: 'X', profile: 'p', unsaved: 0, pending: 0 } as DriveSummary
const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))

beforeEach(() => {
  setLink({ open: true, attempt: 0, roundTripMs: null }, 0)
  setDrives([drive])
  serve(() => 404)
})

describe('an answer that was overtaken', () => {
  it('is not shown as a comparison with what is chosen now', async () => {
    const first = later<object>()
    serve(({ path }) =>
      path.startsWith('/sets')
        ? [{ file: 'a.sdset' }, { file: 'b.sdset' }]
        : path.includes('a.sdset')
          ? first.promise
          : 404,
    )
    await shown(<Compare drive={drive} rows={[]} />)
    const choose = (name: string) =>
      userEvent.selectOptions(screen.getByRole('combobox', { name: 'Compare with' }), name)
    await choose('file a.sdset')
    await press('Compare')
    await choose('file b.sdset')
    await settled(() =>
      first.give({
        file: 'a.sdset',
        rows: [],
        warnings: [],
        same_profile: true,
        same_serial: true,
      }),
    )
    expect(asked.some(({ path }) => path.includes('a.sdset'))).toBe(true)
    expect(screen.queryByText('No difference.')).toBeNull()
    expect(screen.queryByRole('table')).toBeNull()
  })

  it('is not shown as what fits the filters of the library', async () => {
    const slow = later<object>()
    const entries = (id: string) => ({ entries: [{ id }], total: 1, problems: [], shared: false })
    serve(({ path }) =>
      path.startsWith('/library/tags')
        ? []
        : path.includes('words=ab')
          ? entries('ab')
          : slow.promise,
    )
    const library = renderHook((filters: Filters) => useLibrary(filters), {
      initialProps: { ...NO_FILTERS, words: 'a' },
    })
    await waitFor(() => expect(asked.some(({ path }) => /words=a(&|$)/.test(path))).toBe(true))
    library.rerender({ ...NO_FILTERS, words: 'ab' })
    await waitFor(() => expect(library.result.current.entries).toEqual([{ id: 'ab' }]))
    await settled(() => slow.give(entries('a')))
    expect(library.result.current.entries).toEqual([{ id: 'ab' }])
  })

  it('lists more of the library than the server gives at once, each entry once', async () => {
    const total = 620
    serve(({ path }) => {
      if (path.startsWith('/library/tags')) return []
      const query = new URLSearchParams(path.split('?')[1])
      const [offset, limit] = [Number(query.get('offset')), Number(query.get('limit'))]
      if (limit > 500) return 422
      // One was stored after the first part was read: the last of it comes again.
      const begin = offset > 0 ? offset - 1 : 0
      const count = Math.max(0, Math.min(limit, total - begin))
      const entries = Array.from({ length: count }, (_, i) => ({ id: begin + i }))
      return { entries, total, problems: [], shared: false }
    })
    const { result } = renderHook(() => useLibrary(NO_FILTERS))
    await waitFor(() => expect(result.current.entries).toHaveLength(50))
    for (let shown = 100; shown <= 550; shown += 50) {
      await settled(() => result.current.more())
      const least = Math.min(shown, 549)
      await waitFor(() => expect(result.current.entries!.length).toBeGreaterThanOrEqual(least))
    }
    const ids = result.current.entries!.map((each) => each.id)
    expect(new Set(ids).size).toBe(ids.length)
    expect(ids.length).toBeGreaterThan(500)
  })

  it('does not list older entries of the audit twice', async () => {
    serve(({ path }) =>
      path.startsWith('/audit?') || path === '/audit'
        ? path.includes('before=5')
          ? { events: [{ number: 4 }], next: null }
          : { events: [{ number: 5 }], next: 5 }
        : {},
    )
    const { result } = renderHook(() => useAudit(ALL))
    await settled()
    await settled(() => {
      const { older } = result.current
      older!()
      older!()
    })
    expect(result.current.events!.map((each) => each.number)).toEqual([5, 4])
  })
})

describe('a verdict', () => {
  it('is of the anchor that was checked', async () => {
    serve(() => ({ ok: true, entries: 3, head: 'h', broken: null, why: '' }))
    await shown(<ChainCheck />)
    await press('Check the chain')
    await settled()
    expect(screen.getAllByRole('status')).toHaveLength(1)
    fireEvent.change(screen.getByRole('textbox'), { target: { value: `7:${'0'.repeat(64)}` } })
    expect(screen.queryAllByRole('status')).toEqual([])
  })

  it('does not call a password changed that was refused', async () => {
    serve(({ method }) => (method === 'PUT' ? {} : []))
    await shown(<MyAccess />)
    const changed = () => screen.queryByText('Changed. Your other log-ins have ended.')
    const change = async () => {
      await type(screen.getByLabelText(/^Current password/), 'present')
      await type(screen.getByLabelText(/^New password/), 'a-new-password')
      await press('Change the password')
      await settled()
    }
    await change()
    expect(changed()).not.toBeNull()
    serve(({ method }) => (method === 'PUT' ? 403 : []))
    await change()
    expect(asked.at(-1)?.method).toBe('PUT')
    expect(changed()).toBeNull()
  })
})

describe('the right of a guest', () => {
  it('is not shown for all axes where its axis is not connected', async () => {
    const grant = { rights: ['motion'], until: '2026-11-21T10:00:00Z', drive: 'y', by: 'p' }
    const invitation = { id: 'i', guest: 'G', by: 'p', state: 'joined', allowed: [], grant }
    await shown(<SupportBar />)
    await settled(() =>
      setPeople({ people: [], invitations: [invitation as unknown as InvitationView] } as never),
    )
    const granted = screen.getByRole('status').textContent
    expect(granted).toMatch(/\by\b/)
    expect(granted).not.toContain('all axes')
  })
})

describe('a list for other tools', () => {
  it('is fetched below the path of the page', () => {
    expect(listUrl('a b.sdset', 'csv')).toBe('/station/api/v1/sets/a%20b.sdset/list?format=csv')
  })
})

describe('a read of all parameters', () => {
  const job = (part: Partial<JobInfo>) =>
    ({ id: 'j', kind: 'read_all', drive: 'x', title: 'Read', step: '',
       title_message: { code: '', params: { words: 'Read' } }, step_message: { code: '' }, progress: 1, result: null,
       problem: null, started: '2020-01-01T00:00:00Z', ended: null, state: 'running', ...part }) as JobInfo // prettier-ignore

  it('is reported to its end also where the clock of this computer is ahead', async () => {
    const page = await shown(<ParameterTable drive={drive} rows={[]} asked={null} />)
    const problem = { type: 'x', title: '', status: 0, detail: 'the line broke' }
    await settled(() => setJob(job({})))
    await settled(() => setJob(job({ state: 'failed', ended: '2020-01-01T00:00:09Z', problem })))
    expect(screen.queryByText(/the line broke/)).not.toBeNull()
    page.unmount()
    // One that had ended before the page was opened is no news.
    await shown(<ParameterTable drive={drive} rows={[]} asked={null} />)
    expect(screen.queryByText(/the line broke/)).toBeNull()
  })
})
