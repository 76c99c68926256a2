import { describe, expect, it } from 'vitest'
import { grabbed } from './drag'
import { moved } from './MarkerChips'

describe('a press in the plot', () => {
  const cursor = { id: 'cursor 0', away: 4 }
  it('takes the nearest marker, and a notch before the cursor that lies on it', () => {
    expect(grabbed([{ id: 'cursor 1', away: 18 }, cursor])).toBe(cursor)
    const notch = { id: 'notch 0', away: 12 }
    expect(grabbed([cursor, notch])).toBe(notch)
  })
  it('far from all brings the nearest cursor, never a notch', () => {
    const far = { id: 'cursor 0', away: 90 }
    expect(grabbed([{ id: 'notch 0', away: 40 }, far])).toBe(far)
    expect(grabbed([{ id: 'notch 0', away: 40 }])).toBe(null)
  })
})

describe('a key on a marker', () => {
  it('moves it by a share of its frequency, and not out of the plot', () => {
    expect(moved('ArrowRight', false, 100, [5, 400])).toBeCloseTo(101)
    expect(moved('ArrowLeft', true, 100, [5, 400])).toBeCloseTo(99.9)
    expect(moved('PageUp', false, 390, [5, 400])).toBe(400)
  })
  it('brings it to the ends', () => {
    expect(moved('Home', false, 100, [5, 400])).toBe(5)
    expect(moved('End', false, 100, [5, 400])).toBe(400)
    expect(moved('Tab', false, 100, [5, 400])).toBe(null)
  })
})
