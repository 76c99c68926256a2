import { describe, expect, it } from 'vitest'
import { meant } from './press'

const press = { on: 'start', x: 100, y: 100 }

describe('a press', () => {
  it('acts on what it began on, whatever has come there since', () => {
    expect(meant(press, 'start', 101, 100)).toBe('as it is')
    expect(meant(press, null, 100, 100)).toBe('what was pressed')
    expect(meant(press, 'delete', 102, 101)).toBe('what was pressed')
  })
  it('presses nothing that came under a finger on an empty place', () => {
    expect(meant({ on: null, x: 5, y: 5 }, 'start', 5, 5)).toBe('nothing')
    expect(meant({ on: null, x: 5, y: 5 }, null, 5, 5)).toBe('as it is')
  })
  it('is called off by sliding away', () => {
    expect(meant(press, null, 200, 100)).toBe('as it is')
    expect(meant(press, 'delete', 200, 100)).toBe('nothing')
  })
  it('without a pointer, as of a screen reader, is left alone', () => {
    expect(meant(null, 'start', 0, 0)).toBe('as it is')
  })
})
