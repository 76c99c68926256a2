import { asked, later, serve } from '../testing/bench'
import { createElement } from 'react'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { DriveSummary, InvitationView, JobInfo } from '../api/schema'
import { SupportBar } from '../app/SupportBar'
import { setPeople } from '../live/people'
import { setDrives, setJob, setLink } from '../live/store'
import { Page, press, textOf, type } from '../testing/render'
import { ChainCheck } from './audit/ChainCheck'
import { ALL } from './audit/filters'
import { useAudit } from './audit/useAudit'
import { type Filters, NO_FILTERS } from './files/filters'
import { listUrl } from './files/sets'
import { useLibrary } from './files/useLibrary'
import { Compare } from './parameters/Compare'
import { ParameterTable } from './parameters/ParameterTable'
import { MyAccess } from './people/MyAccess'

vi.mock('@mantine/core', () => import('../testing/mantine'))
vi.mock('../live/live', () => ({ stand: () => {}, send: () => {} }))

const drive = { id: 'x', name: 'X', profile: 'p', unsaved: 0, pending: 0 } as DriveSummary
const typed = () => new Promise((resolve) => setTimeout(resolve, 200))

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
    const page = new Page(createElement(Compare, { drive, rows: [] }))
    await page.after(() => type(page.one('NativeSelect'), 'file:a.sdset'))
    await page.after(() => press(page.named('Button', 'Compare')))
    await page.after(() => type(page.one('NativeSelect'), 'file:b.sdset'))
    await page.after(() =>
      first.give({
        file: 'a.sdset',
        rows: [],
        warnings: [],
        same_profile: true,
        same_serial: true,
      }),
    )
    expect(page.all('table')).toEqual([])
    page.end()
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
    let seen: ReturnType<typeof useLibrary> | null = null
    function Library({ filters }: { filters: Filters }) {
      seen = useLibrary(filters)
      return null
    }
    const at = (words: string) => createElement(Library, { filters: { ...NO_FILTERS, words } })
    const page = new Page(at('a'))
    await page.show(at('ab'))
    await typed()
    await page.after()
    await page.after(() => slow.give(entries('a')))
    expect(seen!.entries).toEqual([{ id: 'ab' }])
    page.end()
  })

  it('does not list older entries of the audit twice', async () => {
    serve(({ path }) =>
      path.startsWith('/audit?') || path === '/audit'
        ? path.includes('before=5')
          ? { events: [{ number: 4 }], next: null }
          : { events: [{ number: 5 }], next: 5 }
        : {},
    )
    let seen: ReturnType<typeof useAudit> | null = null
    function Audit() {
      seen = useAudit(ALL)
      return null
    }
    const page = new Page(createElement(Audit))
    await page.after()
    await page.after(() => {
      seen!.older!()
      seen!.older!()
    })
    expect(seen!.events!.map((each) => each.number)).toEqual([5, 4])
    page.end()
  })
})

describe('a verdict', () => {
  it('is of the anchor that was checked', async () => {
    serve(() => ({ ok: true, entries: 3, head: 'h', broken: null, why: '' }))
    const page = new Page(createElement(ChainCheck))
    await page.after(() => press(page.named('Button', 'Check the chain')))
    expect(page.all((each) => each.props.role === 'status')).toHaveLength(1)
    await page.after(() => type(page.one('TextInput'), `7:${'0'.repeat(64)}`))
    expect(page.all((each) => each.props.role === 'status')).toEqual([])
  })

  it('does not call a password changed that was refused', async () => {
    serve(({ method }) => (method === 'PUT' ? {} : []))
    const page = new Page(createElement(MyAccess))
    const change = () =>
      page.after(() => press(page.all('form')[0]!, 'onSubmit', { preventDefault: () => undefined }))
    await page.after()
    await change()
    expect(page.text()).toContain('Changed. Your other log-ins have ended.')
    serve(({ method }) => (method === 'PUT' ? 403 : []))
    await change()
    expect(asked.at(-1)?.method).toBe('PUT')
    expect(page.text()).not.toContain('Changed. Your other log-ins have ended.')
  })
})

describe('the right of a guest', () => {
  it('is not shown for all axes where its axis is not connected', async () => {
    const grant = { rights: ['motion'], until: '2026-11-21T10:00:00Z', drive: 'y', by: 'p' }
    const invitation = { id: 'i', guest: 'G', by: 'p', state: 'joined', allowed: [], grant }
    const page = new Page(createElement(SupportBar))
    await page.after(() =>
      setPeople({ people: [], invitations: [invitation as unknown as InvitationView] } as never),
    )
    expect(page.text()).toContain('y')
    expect(page.text()).not.toContain('all axes')
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
    const page = new Page(createElement(ParameterTable, { drive, rows: [], asked: null }))
    const problem = { type: 'x', title: '', status: 0, detail: 'the line broke' }
    await page.after(() => setJob(job({})))
    await page.after(() => setJob(job({ state: 'failed', ended: '2020-01-01T00:00:09Z', problem })))
    expect(page.all((each) => textOf(each).includes('the line broke'))).not.toEqual([])
    page.end()
    // One that had ended before the page was opened is no news.
    const again = new Page(createElement(ParameterTable, { drive, rows: [], asked: null }))
    expect(again.text()).not.toContain('the line broke')
    again.end()
  })
})
