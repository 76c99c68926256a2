import { expect, it } from 'vitest'
import { warnsOfMotion } from './toolMotion'

const own = { danger: ['DANGER. …', '危险。…'] }

it('warns of every tool that moves the axis and has no warning of its own', () => {
  expect(warnsOfMotion({ motion: true, texts: {} })).toBe(true)
  expect(warnsOfMotion({ motion: true, texts: own })).toBe(false)
  expect(warnsOfMotion({ motion: false, texts: {} })).toBe(false)
})
