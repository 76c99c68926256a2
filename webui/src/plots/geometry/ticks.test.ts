import { expect, it } from 'vitest'
import { range, ticks } from './ticks'

it('gives about as many round values as there is room for', () => {
  expect(ticks(0, 10, 5)).toEqual([0, 2, 4, 6, 8, 10])
  expect(ticks(-0.05, 0.05, 4)).toEqual([-0.05, 0, 0.05])
})

it('ends where the values differ by their last digit, at which a page would hang', () => {
  expect(ticks(1 - Number.EPSILON, 1 + Number.EPSILON, 5).length).toBeLessThan(20)
  expect(ticks(1e9, 1e9 + 1.2e-7, 5).length).toBeLessThan(20)
  for (const bad of [Number.NaN, Number.POSITIVE_INFINITY]) expect(ticks(0, bad, 5)).toEqual([])
  expect(ticks(3, 3, 5).length).toBeLessThan(20)
})

it('keeps a range wide enough to draw', () => {
  const [min, max] = range([1, 1 + Number.EPSILON])
  expect((max - min) / max).toBeGreaterThan(1e-12)
  expect(range([])).toEqual([-1, 1])
  expect(range([5, 5])).toEqual([4.5, 5.5])
})
