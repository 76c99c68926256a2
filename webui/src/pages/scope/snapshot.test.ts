import { answers, requests } from '../../testing/browser'
import { expect, it } from 'vitest'
import { problemOf, setConnection, setCsrf, UNREACHABLE } from '../../api/client'
import { loadSnapshot, storeSnapshot } from './snapshot'

it('stores a snapshot as this page: the server takes no change without its token', async () => {
  setCsrf('token')
  setConnection('c1')
  answers.push({ method: 'POST', path: /snapshots\/a%20b$/, give: () => null })
  await storeSnapshot('a b', new Blob(['data']))
  const { headers } = requests.at(-1)!
  expect(headers.get('X-Servodeck-CSRF')).toBe('token')
  expect(headers.get('X-Servodeck-Connection')).toBe('c1')
  expect(await requests.at(-1)!.text()).toBe('data')
})

it('reports what the server said, and a server that does not answer, as everywhere', async () => {
  const refusal = { type: 'urn:servodeck:forbidden', title: '', status: 403, detail: 'no' }
  answers.unshift({
    method: 'GET',
    path: /snapshots\/x$/,
    give: () => Response.json(refusal, { status: 403 }),
  })
  expect(problemOf(await loadSnapshot('x').catch((e: unknown) => e)).detail).toBe('no')
  answers.unshift({
    method: 'GET',
    path: /snapshots\/x$/,
    give: () => new Response('<html>', { status: 502 }),
  })
  expect(problemOf(await loadSnapshot('x').catch((e: unknown) => e)).status).toBe(502)
  answers.unshift({
    method: 'GET',
    path: /snapshots\/x$/,
    give: () => Promise.reject(new TypeError('Failed to fetch')),
  })
  expect(problemOf(await loadSnapshot('x').catch((e: unknown) => e)).type).toBe(UNREACHABLE)
})
