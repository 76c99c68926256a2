import createClient from 'openapi-fetch'
import { exactJson } from './exact'
import { counted } from './outstanding'
import { withTimeLimit } from './time-limit'
import type { components, paths } from './schema'

export type Problem = components['schemas']['Problem']

/** Where the API is, seen from the page: the page may live under a proxy's path. */
export const API_ROOT = new URL('.', document.baseURI).pathname.replace(/\/$/, '')

let connection: string | null = null

/**
 * The websocket's name: the server lets changes through for the holder of the control lease.
 * A lost one stays until the next: what is pressed meanwhile must not be done whenever the network
 * delivers it, and the server refuses what comes in the name of a connection that has ended.
 */
export function setConnection(id: string): void {
  connection = id
}

let csrf: string | null = null

/** Proof that a change comes from this page: only it can read this and send it back. */
export function setCsrf(token: string | null): void {
  csrf = token
}

/** Called when the server does not know us any more. */
let onUnknown: () => void = () => {}
export function whenUnknown(act: () => void): void {
  onUnknown = act
}

export const api = createClient<paths>({
  baseUrl: API_ROOT,
  fetch: (request) => withTimeLimit(request),
})
api.use({
  onRequest({ request }) {
    if (connection !== null) request.headers.set('X-Servodeck-Connection', connection)
    request.headers.set('Accept-Language', document.documentElement.lang || 'en')
    if (csrf !== null) request.headers.set('X-Servodeck-CSRF', csrf)
    return request
  },
  async onResponse({ response, request }) {
    if (response.status === 401 && !/\/(session|setup|guests)$/.test(request.url)) onUnknown()
    const json = response.headers.get('Content-Type')?.includes('json')
    if (!json || response.status === 204) return undefined
    return new Response(exactJson(await response.text()), response)
  },
})

/** Thrown by `ask`: what went wrong, as the server said it. */
class ProblemError extends Error {
  constructor(readonly problem: Problem) {
    super(problem.detail)
  }
}

/** The data of an answer, or a ProblemError whatever went wrong. */
export async function ask<T>(
  request: Promise<{ data?: T; error?: unknown; response: Response }>,
): Promise<T> {
  let answer: { data?: T; error?: unknown; response: Response }
  try {
    answer = await counted(request)
  } catch {
    throw new ProblemError(unreachable())
  }
  if (!answer.response.ok) {
    throw new ProblemError(asProblem(answer.error, answer.response.status))
  }
  return answer.data as T
}

/** The problem in an exception of `ask`; anything else is a defect and is shown as such. */
export function problemOf(error: unknown): Problem {
  if (error instanceof ProblemError) return error.problem
  return { type: 'about:blank', title: 'Error', status: 0, detail: String(error) }
}

/** Type of the problem that the page itself makes when no answer came. */
export const UNREACHABLE = 'urn:servodeck:page:unreachable'

function unreachable(): Problem {
  return { type: UNREACHABLE, title: 'No answer', status: 0, detail: '' }
}

function asProblem(body: unknown, status: number): Problem {
  if (typeof body === 'object' && body !== null && 'detail' in body) {
    const found = body as Partial<Problem>
    const detail = found.detail
    return {
      type: 'about:blank',
      title: '',
      status,
      ...found,
      detail: typeof detail === 'string' ? detail : JSON.stringify(detail),
    }
  }
  return { type: 'about:blank', title: '', status, detail: typeof body === 'string' ? body : '' }
}
