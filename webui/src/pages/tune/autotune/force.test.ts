import { describe, expect, it } from 'vitest'
import { forceOf } from './force'

const before = { '2005:03': 400, '2005:04': 20, '2008:01': 0 }
const after = { '2005:03': 900, '2005:04': 20, '2008:01': 1 }

describe('a design that was applied', () => {
  it.each([
    ['acts as long as the gains are its own', { '2005:03': 900, '2005:04': 20 }, 'acts'],
    ['is undone when all are as before', { '2005:03': 400, '2005:04': 20 }, 'takenBack'],
    ['is another one after a change by hand', { '2005:03': 700, '2005:04': 20 }, 'changed'],
    ['is trusted where no gain shows it', { '2010:01': 3 }, 'acts'],
  ] as const)('%s', (_name, now, force) => {
    expect(forceOf(before, after, now)).toBe(force)
  })

  it('is kept where nothing was written', () => {
    expect(forceOf({}, {}, before)).toBe('kept')
  })
})
