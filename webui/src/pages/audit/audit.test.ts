import { describe, expect, it } from 'vitest'
import type { AuditEvent } from '../../api/schema'
import { sayIn } from '../../i18n'
import { changeOf, whatOf } from './AuditTable'
import { ALL, auditQuery } from './filters'

const event = (part: Partial<AuditEvent>): AuditEvent => ({
  number: 1,
  time: '2026-11-21T10:00:00Z',
  station: 's',
  person: 'p',
  kind: 'write',
  action: 'written',
  axis: 'X',
  target: '2005:03',
  old: null,
  new: null,
  outcome: '',
  outcome_message: null,
  title_message: null,
  detail: {},
  hash: '',
  ...part,
})

const say = sayIn('zh')

describe('an entry', () => {
  it('says what changed, and what was wanted where that differs', () => {
    expect(changeOf(event({ old: 0, new: 350 }))).toBe('0 → 350')
    expect(changeOf(event({ old: null, new: 350 }))).toBe('? → 350')
    expect(changeOf(event({ old: 1, new: null, detail: { wanted: 2 } }))).toBe('1 → ? (2)')
    expect(changeOf(event({ kind: 'login' }))).toBe('')
  })

  it('names the thing as people know it', () => {
    expect(whatOf(event({ detail: { parameter: 'Gain' } }), say)).toBe('2005:03 Gain')
    expect(
      whatOf(
        event({
          target: 'move-1',
          title_message: { code: 'work.of-drive', params: { title: '移动', drive: 'X' } },
        }),
        say,
      ),
    ).toContain('X')
    expect(whatOf(event({ target: 'a.sdset', detail: { version: 3 } }), say)).toBe('a.sdset · 3')
  })
})

it('asks for whole days', () => {
  const query = auditQuery({ ...ALL, since: '2026-11-21', until: '2026-11-21' })
  expect(query.since).toBe(new Date(2026, 10, 21).toISOString())
  expect(query.until).toBe(new Date(2026, 10, 22).toISOString())
})
