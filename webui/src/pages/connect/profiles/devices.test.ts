import { describe, expect, it } from 'vitest'
import { deviceFor, deviceLabel, PROFILE_NAME } from './devices'

const device = (product_code: number | null, revision: number | null) => ({
  name: 'D',
  product_code,
  revision,
})

describe('the device of a file that a found drive is', () => {
  const series = [device(1, 1), device(2, 1), device(2, 3), device(2, 9)]
  it('is the same product and revision', () => {
    expect(deviceFor(series, { product_code: 2, revision: 3 })).toBe(2)
  })
  it('is the newest revision that is not above the drive’s', () => {
    expect(deviceFor(series, { product_code: 2, revision: 8 })).toBe(2)
    expect(deviceFor(series, { product_code: 2, revision: 0 })).toBe(1)
  })
  it('is the first one where nothing is known or nothing fits', () => {
    expect(deviceFor(series)).toBe(0)
    expect(deviceFor(series, { product_code: null, revision: null })).toBe(0)
    expect(deviceFor(series, { product_code: 77, revision: 1 })).toBe(0)
    expect(deviceFor([], { product_code: 2, revision: 3 })).toBe(0)
  })
  it('is named with its numbers', () => {
    expect(deviceLabel(device(0x190, null))).toBe('D 0x190')
  })
})

describe('names of profiles', () => {
  it('are plain', () => {
    expect(PROFILE_NAME.test('my_drive2')).toBe(true)
    for (const bad of ['', 'My', '2x', 'a-b', '../a', 'a b']) {
      expect(PROFILE_NAME.test(bad)).toBe(false)
    }
  })
})
