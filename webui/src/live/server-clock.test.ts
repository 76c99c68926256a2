import { afterEach, beforeEach, expect, it, vi } from 'vitest'
import { forgetServerClock, heardServerTime, serverNow } from './server-clock'

const at = (text: string) => Date.parse(text)
beforeEach(() => {
  vi.useFakeTimers()
  forgetServerClock()
})
afterEach(() => vi.useRealTimers())

it('is the clock of this computer until the server has stated a time', () => {
  vi.setSystemTime(at('2026-01-01T10:00:00Z'))
  expect(serverNow()).toBe(at('2026-01-01T10:00:00Z'))
})

it('follows the clock of the server where that is another one', () => {
  vi.setSystemTime(at('2026-01-01T10:00:00Z'))
  heardServerTime('2026-01-01T09:00:00Z')
  expect(serverNow()).toBe(at('2026-01-01T09:00:00Z'))
  vi.setSystemTime(at('2026-01-01T10:00:30Z'))
  expect(serverNow()).toBe(at('2026-01-01T09:00:30Z'))
  // What was on its way for long says less than what came at once.
  heardServerTime('2026-01-01T09:00:20Z')
  expect(serverNow()).toBe(at('2026-01-01T09:00:30Z'))
  heardServerTime('2026-01-01T09:00:31Z')
  expect(serverNow()).toBe(at('2026-01-01T09:00:31Z'))
  heardServerTime('no time')
  expect(serverNow()).toBe(at('2026-01-01T09:00:31Z'))
})

it('measures anew at the next connection', () => {
  vi.setSystemTime(at('2026-01-01T10:00:00Z'))
  heardServerTime('2026-01-01T11:00:00Z')
  forgetServerClock()
  heardServerTime('2026-01-01T10:00:00Z')
  expect(serverNow()).toBe(at('2026-01-01T10:00:00Z'))
})
