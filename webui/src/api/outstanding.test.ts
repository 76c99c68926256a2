import { expect, test } from 'vitest'
import { counted, moment, outstanding } from './outstanding'

test('what is asked after a moment is awaited until it has ended, well or badly', async () => {
  let answer: (text: string) => void = () => {}
  let fail: (why: Error) => void = () => {}
  const before = counted(new Promise(() => {}))
  const since = moment()
  expect(outstanding(since)).toBe(false) // the one before never ends, and is nobody's business
  const good = counted(new Promise<string>((done) => (answer = done)))
  const bad = counted(new Promise<string>((_, failed) => (fail = failed)))
  expect(outstanding(since)).toBe(true)
  answer('here')
  await expect(good).resolves.toBe('here')
  expect(outstanding(since)).toBe(true)
  fail(new Error('away'))
  await expect(bad).rejects.toThrow('away')
  expect(outstanding(since)).toBe(false)
  void before
})
