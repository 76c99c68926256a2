import { describe, expect, it } from 'vitest'
import { nearestPoint, pointAt, type XyCurve } from './xy-points'

/** A square run through once, a corner each second, in a drawing of 100 by 200 px. */
const CURVE: XyCurve = {
  x: [0, 10, 10, 0],
  y: [0, 0, 4, 4],
  times: [5, 6, 7, 8],
  xs: [-10, 30],
  ys: [-4, 4],
}
const SIZE = { width: 100, height: 200 }

describe('a moment on a curve of one quantity over another', () => {
  it('is that of the nearest point as it is drawn', () => {
    // 10 across lies at half of −10…30, 0 up at half of −4…4.
    expect(nearestPoint(CURVE, SIZE, 50, 100)).toBe(1)
    expect(nearestPoint(CURVE, SIZE, 60, 20)).toBe(2)
    expect(nearestPoint(CURVE, SIZE, 0, 0)).toBe(3)
    expect(nearestPoint({ ...CURVE, times: [] }, SIZE, 0, 0)).toBeNull()
  })
  it('is the last where several lie at one place, as while the axis is at standstill', () => {
    const standing = { ...CURVE, x: [10, 10, 10, 10], y: [0, 0, 0, 0] }
    expect(nearestPoint(standing, SIZE, 0, 0)).toBe(3)
  })
  it('is found again by its time, at the nearer of two points', () => {
    expect(pointAt(CURVE, SIZE, 6)).toEqual({ left: 50, top: 100 })
    expect(pointAt(CURVE, SIZE, 6.4)).toEqual({ left: 50, top: 100 })
    expect(pointAt(CURVE, SIZE, 6.6)).toEqual({ left: 50, top: 0 })
    expect(pointAt(CURVE, SIZE, 8)).toEqual({ left: 25, top: 0 })
  })
  it('is nowhere where the drawn stretch does not reach', () => {
    expect(pointAt(CURVE, SIZE, 4.9)).toBeNull()
    expect(pointAt(CURVE, SIZE, 8.1)).toBeNull()
    expect(pointAt({ ...CURVE, times: [] }, SIZE, 5)).toBeNull()
  })
})
