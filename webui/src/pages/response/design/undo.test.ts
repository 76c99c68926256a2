import { describe, expect, it } from 'vitest'
import type { Problem } from '../../../api/schema'
import { changedSince } from './undo'

const refused: Problem = {
  type: 'urn:servodeck:not-allowed',
  title: 'Not allowed',
  status: 409,
  detail: 'X: 2005:03 is 130 now, where this change had left 120',
  parameter: '2005:03',
  limit: '120',
}

describe('taking back over what somebody wrote since', () => {
  it('is offered where that alone was in the way', () => {
    expect(changedSince(refused, { '2005:03': 100 })).toBe(true)
    expect(changedSince(null, { '2005:03': 100 })).toBe(false)
    expect(changedSince({ ...refused, parameter: '2005:04' }, { '2005:03': 100 })).toBe(false)
    expect(changedSince({ ...refused, limit: null }, { '2005:03': 100 })).toBe(false)
    expect(changedSince({ ...refused, type: 'urn:servodeck:busy' }, { '2005:03': 100 })).toBe(false)
  })
})
