import { describe, expect, it } from 'vitest'
import { lineWidth } from './line-width'

describe('line width', () => {
  it('is easy to follow where there are few points', () => {
    expect(lineWidth(500, 1)).toBe(1.5)
  })
  it('is one pixel of an ordinary screen where there are many, also of a scaled one', () => {
    expect(lineWidth(35_000, 1)).toBe(1)
    expect(lineWidth(35_000, 1.25) * 1.25).toBe(1)
  })
  it('stays a pixel of CSS on a fine screen', () => {
    expect(lineWidth(35_000, 2)).toBe(1)
    expect(lineWidth(35_000, 3)).toBe(1)
  })
  it('never vanishes where the page is made smaller', () => {
    expect(lineWidth(35_000, 0.5) * 0.5).toBe(1)
  })
})
