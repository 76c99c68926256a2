import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { setLink } from '../../live/store'
import { arrived } from './arrived'

const link = (open: boolean) => setLink({ open, attempt: 0, roundTripMs: null }, 0)

beforeEach(() => {
  vi.useFakeTimers()
  link(true)
})
afterEach(() => {
  vi.useRealTimers()
})

test('a page that was asked for without a connection comes when there is one', async () => {
  let there = false
  const load = vi.fn(() => (there ? Promise.resolve('page') : Promise.reject(new Error('cut'))))
  const page = arrived(load)
  await vi.advanceTimersByTimeAsync(100)
  link(false) // word of it comes after the fetch has failed
  await vi.advanceTimersByTimeAsync(60_000)
  expect(load).toHaveBeenCalledTimes(1)
  there = true
  link(true)
  await expect(page).resolves.toBe('page')
})

test('what a server with a good connection does not have is a defect', async () => {
  const load = vi.fn(() => Promise.reject(new Error('404')))
  const refused = expect(arrived(load)).rejects.toThrow('404')
  await vi.advanceTimersByTimeAsync(10_000)
  await refused
  expect(load).toHaveBeenCalledTimes(3)
})
