import { describe, expect, it } from 'vitest'
import { cameraFor, written } from './camera'

const distance = (place: number, aspect: number) => {
  const { position, lookAt } = cameraFor(place, 3, aspect)
  return Math.hypot(...position.map((value, k) => value - lookAt[k]!))
}

describe('the camera of the scene', () => {
  it('begins before the chosen axis, which is where the server puts it', () => {
    expect(cameraFor(0, 3, 1.6).lookAt[1]).toBeCloseTo(0.9)
    expect(cameraFor(1, 3, 1.6).lookAt[1]).toBeCloseTo(0)
    expect(cameraFor(1, 2, 1.6).lookAt[1]).toBeCloseTo(-0.45)
    expect(cameraFor(-1, 3, 1.6).lookAt).toEqual([0, 0, 0.1])
  })

  it('sees as much from side to side in a narrow window as in a wide one', () => {
    for (const place of [-1, 1]) {
      const seen = (aspect: number) => distance(place, aspect) * aspect
      expect(seen(0.625)).toBeCloseTo(seen(1.25))
      expect(distance(place, 2)).toBeCloseTo(distance(place, 1.25))
    }
  })

  it('has the nearest of many axes before it, as far away as the nearest of three', () => {
    for (const aspect of [1.6, 0.5]) {
      const before = (count: number) =>
        -cameraFor(-1, count, aspect).position[1] - ((count - 1) / 2) * 0.9
      expect(before(7)).toBeGreaterThan(1.4 - 1e-9)
      expect(before(7) * Math.min(aspect, 1.25)).toBeCloseTo(1.75, 5)
    }
  })

  it('never stands so far away that nothing can be distinguished', () => {
    expect(distance(-1, 0.1)).toBeCloseTo(2.5 * distance(-1, 1.25))
  })

  it('writes points as the viewer reads them', () => {
    expect(written([0.3, -2.3, 1.5])).toBe('0.300,-2.300,1.500')
  })
})
