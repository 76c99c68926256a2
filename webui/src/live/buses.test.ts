import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import type { Bus } from '../api/schema'
import { api } from '../api/client'
import { askBuses, knownBuses, PERIOD_MS, refreshBuses, watchBuses } from './buses'
import { setLink } from './store'

vi.mock('../api/client', () => ({
  api: { GET: vi.fn() },
  ask: (answer: Promise<unknown>) => answer,
}))

/** How each request is answered: taken off one by one. */
let answers: ((buses: Bus[]) => void)[] = []
const asked = vi.mocked(api.GET as unknown as () => Promise<Bus[]>)
const bus = (url: string) => ({ url }) as Bus
const link = (open: boolean) => setLink({ open, attempt: 0, roundTripMs: null }, 0)
let ends: (() => void)[] = []
const watch = () => ends.push(watchBuses())

beforeEach(() => {
  vi.useFakeTimers()
  asked.mockReset()
  asked.mockImplementation(() => Promise.resolve([bus('ethercat://eth0')]))
  answers = []
  link(true)
})
afterEach(() => {
  for (const end of ends) end()
  ends = []
  link(false) // what was not answered is forgotten
  vi.useRealTimers()
})

const unanswered = () =>
  asked.mockImplementation(() => new Promise((answer) => answers.push(answer)))

test('however many components show the buses, they are asked for once per period', async () => {
  watch()
  watch()
  watch()
  await vi.advanceTimersByTimeAsync(PERIOD_MS / 2)
  expect(asked).toHaveBeenCalledTimes(1)
  await vi.advanceTimersByTimeAsync(5 * PERIOD_MS)
  expect(asked).toHaveBeenCalledTimes(6)
  expect(knownBuses()).toEqual([bus('ethercat://eth0')])
})

test('nothing is asked after the last component has gone', async () => {
  const first = watchBuses()
  const second = watchBuses()
  first()
  await vi.advanceTimersByTimeAsync(PERIOD_MS)
  expect(asked).toHaveBeenCalledTimes(2)
  second()
  await vi.advanceTimersByTimeAsync(5 * PERIOD_MS)
  expect(asked).toHaveBeenCalledTimes(2)
})

test('nothing is asked without a connection, and at once when it is back', async () => {
  link(false)
  watch()
  await vi.advanceTimersByTimeAsync(5 * PERIOD_MS)
  expect(asked).toHaveBeenCalledTimes(0)
  link(true)
  link(true) // as with each measured round trip
  expect(asked).toHaveBeenCalledTimes(1)
})

test('a server that answers slowly has one request at a time', async () => {
  unanswered()
  watch()
  void askBuses()
  await vi.advanceTimersByTimeAsync(5 * PERIOD_MS)
  expect(asked).toHaveBeenCalledTimes(1)
})

test('after a change the answer to an earlier request is not enough', async () => {
  unanswered()
  watch()
  let fresh = false
  void refreshBuses().then(() => (fresh = true))
  answers.shift()?.([bus('before')])
  await vi.advanceTimersByTimeAsync(0)
  expect(fresh).toBe(false)
  answers.shift()?.([bus('after')])
  await vi.advanceTimersByTimeAsync(0)
  expect(fresh).toBe(true)
  expect(knownBuses()).toEqual([bus('after')])
})

test('a request over a lost connection holds up nothing, and its late answer counts no more', async () => {
  unanswered()
  watch()
  link(false)
  link(true)
  expect(asked).toHaveBeenCalledTimes(2)
  answers[1]?.([bus('now')])
  answers[0]?.([bus('from before')])
  await vi.advanceTimersByTimeAsync(0)
  expect(knownBuses()).toEqual([bus('now')])
})
