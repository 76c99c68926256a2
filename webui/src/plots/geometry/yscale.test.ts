import { describe, expect, it } from 'vitest'
import { Extent, moved, pinched, sound, wheelFactor, withAir, zoomed } from './yscale'

describe('y scales', () => {
  it('show all that was seen with air, and are never of no height', () => {
    const seen = new Extent()
    expect(withAir(seen.span)).toEqual({ min: -1, max: 1 })
    seen.see(0)
    seen.see(100)
    expect(withAir(seen.span)).toEqual({ min: -8, max: 108 })
    const flat = new Extent()
    flat.see(5)
    expect(withAir(flat.span)).toEqual({ min: 4.5, max: 5.5 })
  })

  it('zoom about the pointer, which stays where it is', () => {
    expect(zoomed({ min: 0, max: 100 }, 25, 0.5)).toEqual({ min: 12.5, max: 62.5 })
    const near = zoomed({ min: -1, max: 1 }, 0.5, wheelFactor({ deltaX: 0, deltaY: -3 }))
    expect((0.5 - near.min) / (near.max - near.min)).toBeCloseTo(0.75, 3)
  })

  it('keep between two fingers what was between them', () => {
    // Fingers at 20 and 60 of 0…100, moved to where 40 and 80 were, and then to twice that far.
    const began = { apart: 40, part: 0.4 }
    expect(pinched({ min: 0, max: 100 }, began, { apart: 40, part: 0.6 })).toEqual({
      min: -20,
      max: 80,
    })
    expect(pinched({ min: 0, max: 100 }, began, { apart: 80, part: 0.4 })).toEqual({
      min: 20,
      max: 70,
    })
    // Fingers that meet show a great deal, and no more than numbers can show.
    const met = pinched({ min: 0, max: 100 }, began, { apart: 0, part: 0.5 })
    expect(met.max - met.min).toBe(4000)
  })

  it('turn the same way with Shift, where the wheel goes sideways', () => {
    expect(wheelFactor({ deltaX: 120, deltaY: 0 })).toBe(wheelFactor({ deltaX: 0, deltaY: 120 }))
  })

  it('have round ends, at least a thousandth of their height fine', () => {
    expect(sound({ min: -3.14159265, max: 2.71828182 })).toEqual({ min: -3.142, max: 2.718 })
    expect(sound({ min: 123456.78, max: 123457.89 })).toEqual({ min: 123456.78, max: 123457.89 })
    expect(moved({ min: 1, max: 2 }, -3)).toEqual({ min: -2, max: -1 })
  })

  it('keep some height however far they are zoomed', () => {
    for (const at of [0, 1e6, -2e9]) {
      const { min, max } = sound({ min: at, max: at })
      expect(max).toBeGreaterThan(min)
    }
  })
})

describe('a scale of samples that differ by their last digit', () => {
  it('is high enough for a drawing to find ticks in it', () => {
    for (const at of [1, -7, 1e9, 123456.789, 1e-9]) {
      const { min, max } = withAir({ min: at, max: at + Math.abs(at) * Number.EPSILON })
      // A step of a hundredth of it changes the number that it is added to.
      expect(Math.abs(at) + (max - min) / 100).toBeGreaterThan(Math.abs(at))
      expect((max - min) / Math.abs(at)).toBeGreaterThan(1e-12)
    }
  })
})
