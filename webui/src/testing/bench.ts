/**
 * What modules of the page need of a browser, and a server that a test answers for. To be imported
 * before everything else.
 */

const ORIGIN = 'http://bench'

interface Asked {
  method: string
  /** Path and query. */
  path: string
  body: unknown
}

type Answer = object | number | null
type Server = (asked: Asked) => Answer | Promise<Answer>

let server: Server = () => 404

/** Everything that the page asked for, in order. */
export const asked: Asked[] = []

/** A refusal of the server. */
export const refusal = (status: number, part: object = {}) => ({
  type: 'urn:servodeck:not-allowed',
  title: '',
  status,
  detail: `refused with ${status}`,
  ...part,
})

/** Answer the page's requests from now on; a number is the status of a refusal. */
export function serve(next: Server): void {
  server = next
  asked.length = 0
}

/** An answer that a test gives later. */
export function later<T>(): { promise: Promise<T>; give: (answer: T) => void } {
  let give: (answer: T) => void = () => {}
  const promise = new Promise<T>((resolve) => {
    give = resolve
  })
  return { promise, give }
}

class AbsoluteRequest extends Request {
  constructor(input: RequestInfo | URL, init?: RequestInit) {
    super(typeof input === 'string' ? new URL(input, ORIGIN) : input, init)
  }
}

async function answered(request: Request): Promise<Response> {
  const url = new URL(request.url)
  const text = await request.text()
  const one = {
    method: request.method,
    path: `${url.pathname.replace('/station/api/v1', '')}${url.search}`,
    body: text === '' ? null : (JSON.parse(text) as unknown),
  }
  asked.push(one)
  const found = await server(one)
  const headers = { 'Content-Type': 'application/json' }
  const problem = typeof found === 'number' ? refusal(found) : found
  if (problem && 'status' in problem && typeof problem.status === 'number') {
    return new Response(JSON.stringify(problem), { status: problem.status, headers })
  }
  return new Response(JSON.stringify(found), { headers })
}

const kept = () => {
  const values = new Map<string, string>()
  return {
    getItem: (name: string) => values.get(name) ?? null,
    setItem: (name: string, value: string) => void values.set(name, value),
    removeItem: (name: string) => void values.delete(name),
  }
}
const element = () => ({ lang: 'en', dataset: {}, style: {} })
const nothing = () => undefined

Object.assign(globalThis, {
  Request: AbsoluteRequest,
  fetch: answered,
  localStorage: kept(),
  sessionStorage: kept(),
  HTMLInputElement: Object,
  Worker: class {
    postMessage = nothing
  },
  ResizeObserver: class {
    observe = nothing
    disconnect = nothing
  },
  document: {
    // Behind a proxy's path, where an address without it leads nowhere.
    baseURI: `${ORIGIN}/station/`,
    documentElement: element(),
    createElement: element,
    getElementById: () => null,
    addEventListener: nothing,
    removeEventListener: nothing,
  },
  window: Object.assign(globalThis, {
    location: { hash: '', origin: ORIGIN, pathname: '/', protocol: 'http:', host: 'bench' },
    addEventListener: nothing,
    removeEventListener: nothing,
    matchMedia: () => ({ matches: false, addEventListener: nothing, removeEventListener: nothing }),
  }),
})
