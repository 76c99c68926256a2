import { expect, it } from 'vitest'
import { faultOf, toNumber } from './number-text'
import { parseTyped } from './parse'
import type { ParameterInfo } from '../parameters/types'

it('takes a point or a comma, and no number that cannot be sent', () => {
  expect(['1.5', '1,5', ' −2 ', '.5', '1e3'].map(toNumber)).toEqual([1.5, 1.5, -2, 0.5, 1000])
  for (const text of ['', '-', '1o0', '1,2,3', 'NaN', 'Infinity', '1e400', '-1e400']) {
    expect(toNumber(text), text).toBeNull()
  }
})

it('states why a number is not allowed', () => {
  expect(faultOf('1e400', { above: 0 })).toEqual({ key: 'number.bad' })
  expect(faultOf('0', { above: 0 })).toEqual({ key: 'number.above', limit: 0 })
  expect(faultOf('1.5', { integer: true })).toEqual({ key: 'number.whole' })
  expect(faultOf('1.5', { min: 1, max: 2 })).toBeNull()
})

it('writes no infinite value to a parameter, which would be sent as none', () => {
  const real = {
    type: 'REAL32',
    enum: {},
    scale: 1,
    offset: 0,
    min_raw: null,
    max_raw: null,
    unit: '',
  } as unknown as ParameterInfo
  expect(parseTyped(real, '1e400', false)).toMatchObject({ ok: false })
  expect(parseTyped(real, '1e3', false)).toEqual({ ok: true, value: 1000 })
})
