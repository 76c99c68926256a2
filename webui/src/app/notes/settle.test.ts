import { describe, expect, it } from 'vitest'
import { settled } from './settle'

/** Where the page's content begins on the screen: it must not change. */
const top = ({ scrolled, left }: { scrolled: number; left: number }, notices: number) =>
  notices + left - scrolled

describe('a notice above a page', () => {
  it('comes and goes without moving what is below it', () => {
    const open = { scrolled: 0, left: 0 }
    const reported = settled(open, 0, 80)
    expect(reported).toEqual({ scrolled: 80, left: 0 })
    expect(settled(reported, 80, 0)).toEqual(open)
    const deep = settled({ scrolled: 300, left: 0 }, 0, 80)
    expect(deep).toEqual({ scrolled: 380, left: 0 })
  })
  it('leaves its room where somebody has scrolled up to see all, until the next one', () => {
    const up = { scrolled: 0, left: 0 }
    const gone = settled(up, 80, 0)
    expect(gone).toEqual({ scrolled: 0, left: 80 })
    expect(settled(gone, 0, 50)).toEqual({ scrolled: 0, left: 30 })
    expect(settled(gone, 0, 100)).toEqual({ scrolled: 20, left: 0 })
    const half = { scrolled: 30, left: 0 }
    expect(top(settled(half, 80, 0), 0)).toBe(top(half, 80))
  })
  it('counts what the browser has scrolled by itself', () => {
    expect(settled({ scrolled: 380, left: 0 }, 0, 80, 80)).toEqual({ scrolled: 380, left: 0 })
  })
})
