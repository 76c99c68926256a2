// @vitest-environment happy-dom
import { asked, refusal, serve } from '../../../testing/page'
import { expect, it } from 'vitest'
import { problemOf, setConnection, setCsrf, UNREACHABLE } from '../../../api/client'
import { loadSnapshot, storeSnapshot } from './snapshot'

it('stores a snapshot as this page: the server takes no change without its token', async () => {
  setCsrf('token')
  setConnection('c1')
  serve(() => null)
  await storeSnapshot('a b', new Blob(['data']))
  const { method, path, headers, body } = asked.at(-1)!
  expect([method, path]).toEqual(['POST', '/scope/snapshots/a%20b'])
  expect(headers.get('X-Servodeck-CSRF')).toBe('token')
  expect(headers.get('X-Servodeck-Connection')).toBe('c1')
  expect(body).toBe('data')
})

it('reports what the server said, and a server that does not answer, as everywhere', async () => {
  const failed = () => loadSnapshot('x').then(() => null, problemOf)
  serve(() => refusal(403, { detail: 'no' }))
  expect((await failed())?.detail).toBe('no')
  serve(() => new Response('<html>', { status: 502 }))
  expect((await failed())?.status).toBe(502)
  serve(() => Promise.reject(new TypeError('Failed to fetch')))
  expect((await failed())?.type).toBe(UNREACHABLE)
  expect(asked.at(-1)?.path).toBe('/scope/snapshots/x')
})
