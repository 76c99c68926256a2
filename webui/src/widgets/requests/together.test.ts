import { expect, it, vi } from 'vitest'
import { together } from './together'

it('asks once for what several forms of a drive need', async () => {
  const send = vi.fn<(drive: string, keys: string[]) => Promise<void>>(() => Promise.resolve())
  const ask = together(send)
  await Promise.all([
    ask('x', ['2005:03', '2005:04']),
    ask('y', ['2005:03']),
    ask('x', ['2005:04', '2005:05']),
    ask('x', []),
  ])
  expect(send.mock.calls).toEqual([
    ['x', ['2005:03', '2005:04', '2005:05']],
    ['y', ['2005:03']],
  ])
  // What is asked for later is another request.
  await ask('x', ['2005:03'])
  expect(send).toHaveBeenCalledTimes(3)
})

it('reports a failure to all that asked', async () => {
  const ask = together(() => Promise.reject(new Error('in use')))
  const asked = await Promise.allSettled([ask('x', ['2005:03']), ask('x', ['2005:04'])])
  expect(asked.map((each) => each.status)).toEqual(['rejected', 'rejected'])
})
