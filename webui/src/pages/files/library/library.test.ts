import { describe, expect, it } from 'vitest'
import { NO_FILTERS, queryOf, UNDO } from './filters'

describe('queryOf', () => {
  it('leaves sets made before loading out until they are wanted', () => {
    expect(queryOf(NO_FILTERS, 50).without).toBe(UNDO)
    expect(queryOf({ ...NO_FILTERS, undo: true }, 50).without).toBe('')
    expect(queryOf({ ...NO_FILTERS, tag: UNDO }, 50).without).toBe('')
  })

  it('takes days in the calendar of the person, the last one as a whole', () => {
    const query = queryOf({ ...NO_FILTERS, since: '2026-11-20', until: '2026-11-21' }, 50)
    expect(query.since).toBe(new Date(2026, 10, 20).toISOString())
    expect(query.until).toBe(new Date(2026, 10, 22).toISOString())
  })
})
