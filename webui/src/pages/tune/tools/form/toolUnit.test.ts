import { expect, test } from 'vitest'
import { unitOf } from './toolUnit'

const texts: Record<string, string> = { 'unit.slow_rpm': 'rpm' }
const text = (name: string) => texts[name] ?? name

test('a field has the unit that its tool states, and none without one', () => {
  expect(unitOf('slow_rpm', text)).toEqual({ unit: 'rpm' })
  // Its label has the unit already.
  expect(unitOf('speed_rpm', text)).toEqual({})
})
