import { afterEach, describe, expect, it, vi } from 'vitest'
import { withTimeLimit } from './time-limit'

/** A network that swallows everything: only giving up ends a request. */
const silent = ((_request: Request, options?: RequestInit) =>
  options?.signal?.aborted
    ? Promise.reject(new Error('given up'))
    : new Promise(() => {})) as typeof fetch

afterEach(() => vi.restoreAllMocks())

describe('a request', () => {
  it('ends although nothing answers, a file after a longer time', async () => {
    const limits: number[] = []
    vi.spyOn(AbortSignal, 'timeout').mockImplementation((limit) => {
      limits.push(limit)
      return AbortSignal.abort(new DOMException('', 'TimeoutError'))
    })
    await expect(withTimeLimit(new Request('http://x/a'), silent)).rejects.toThrow()
    const headers = { 'Content-Type': 'application/octet-stream' }
    const upload = new Request('http://x/b', { method: 'POST', body: 'abc', headers })
    await expect(withTimeLimit(upload, silent)).rejects.toThrow()
    expect(limits).toEqual([60_000, 900_000])
  })
})
