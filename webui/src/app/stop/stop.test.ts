// @vitest-environment happy-dom
import { later, posted, serve } from '../../testing/page'
import { afterEach, beforeEach, expect, it, vi } from 'vitest'
import type { StopResult } from '../../api/schema'
import { contents, publish, setLink } from '../../live/store'
import { currentReport, dismissReport, listenForAnswers, stopEverything } from './stop'

const RESULT = { stopped: ['x'], failed: {}, axes: [] } as unknown as StopResult
/** A network that swallows everything: neither an answer nor an error. */
const swallowed = () => new Promise<never>(() => {})
const stop = (answer: () => Promise<never> | StopResult) =>
  serve(({ method, path }) => (method === 'POST' && path === '/stop' ? answer() : 404))
/** The number of the last press. */
const press = () => currentReport()?.press ?? 0
const taken = (of = press()) => {
  contents.stopTaken = { press: of }
  publish('stopTaken')
}
const reached = (of = press()) => {
  contents.stopReached = { press: of, result: RESULT }
  publish('stopReached')
}
const link = (open: boolean) => setLink({ open, attempt: open ? 0 : 1, roundTripMs: null }, 0)

listenForAnswers()
beforeEach(() => {
  vi.useFakeTimers()
  posted.splice(0)
  dismissReport()
  link(true)
})
afterEach(() => vi.useRealTimers())

it('goes both ways, and states what it reached', async () => {
  stop(() => RESULT)
  await stopEverything()
  expect(posted).toContainEqual({
    kind: 'send',
    message: { type: 'stop', drive: null, press: press() },
  })
  expect(currentReport()).toMatchObject({ answer: RESULT, failure: null })
})

it('sends to the emergency stop when nothing says that it has gone out', () => {
  stop(swallowed)
  void stopEverything()
  vi.advanceTimersByTime(1000)
  expect(currentReport()?.failure).toBeNull()
  vi.advanceTimersByTime(3000)
  expect(currentReport()?.failure).toBe('unknown')
})

it('takes that back when the server says that it has gone out after all', () => {
  stop(swallowed)
  void stopEverything()
  vi.advanceTimersByTime(4000)
  taken()
  expect(currentReport()).toMatchObject({ failure: null, taken: true })
})

it('sends to the emergency stop when the connection goes before the axes are seen to stand', () => {
  stop(swallowed)
  void stopEverything()
  taken()
  vi.advanceTimersByTime(500)
  expect(currentReport()?.failure).toBeNull()
  link(false)
  expect(currentReport()?.failure).toBe('unknown')
  // The verdicts may still come by the next connection's time.
  reached()
  expect(currentReport()).toMatchObject({ answer: RESULT, failure: null })
})

it('does not report on a STOP that was answered or put away', async () => {
  stop(() => RESULT)
  await stopEverything()
  vi.advanceTimersByTime(10_000)
  link(false)
  expect(currentReport()?.failure).toBeNull()
  stop(swallowed)
  void stopEverything()
  dismissReport()
  vi.advanceTimersByTime(10_000)
  expect(currentReport()).toBeNull()
})

it('takes no answer to an earlier press for one to this', () => {
  stop(swallowed)
  void stopEverything()
  const earlier = press()
  void stopEverything()
  expect(press()).not.toBe(earlier)
  taken(earlier)
  reached(earlier)
  expect(currentReport()).toMatchObject({ answer: null, taken: false })
  vi.advanceTimersByTime(4000)
  expect(currentReport()?.failure).toBe('unknown')
  taken()
  reached()
  expect(currentReport()).toMatchObject({ answer: RESULT, taken: true, failure: null })
})

it('is not answered by the request of an earlier press in the same millisecond', async () => {
  const first = later<StopResult>()
  let requests = 0
  stop(() => ((requests += 1) === 1 ? (first.promise as Promise<never>) : swallowed()))
  const earlier = stopEverything()
  void stopEverything()
  first.give(RESULT)
  await earlier
  expect(currentReport()?.answer).toBeNull()
})
