/**
 * What the page's modules need of a browser when they are loaded in a test. Import it first.
 *
 * `answers` takes the requests of the page: the first that fits, by method and path, is used.
 */
import { vi } from 'vitest'

class Target {
  private readonly heard = new Map<string, Set<(event: unknown) => void>>()
  addEventListener(kind: string, act: (event: unknown) => void): void {
    this.heard.set(kind, (this.heard.get(kind) ?? new Set()).add(act))
  }
  removeEventListener(kind: string, act: (event: unknown) => void): void {
    this.heard.get(kind)?.delete(act)
  }
  dispatch(kind: string, event: unknown = {}): void {
    for (const act of [...(this.heard.get(kind) ?? [])]) act(event)
  }
}

class Storage {
  private readonly kept = new Map<string, string>()
  getItem = (key: string) => this.kept.get(key) ?? null
  setItem = (key: string, value: string) => void this.kept.set(key, value)
  removeItem = (key: string) => void this.kept.delete(key)
}

/** Takes what the page posts to its worker. */
class Worker {
  static readonly posted: unknown[] = []
  onmessage: ((event: { data: unknown }) => void) | null = null
  constructor() {
    worker.current = this
  }
  postMessage(message: unknown): void {
    Worker.posted.push(message)
  }
}
export const worker: { current: Worker | null } = { current: null }
export const posted = Worker.posted

const PAGE = 'http://server/'
class PageRequest extends Request {
  constructor(input: RequestInfo | URL, init?: RequestInit) {
    super(typeof input === 'string' ? new URL(input, PAGE) : input, init)
  }
}

export const page = Object.assign(new Target(), {
  location: { hash: '', host: 'server', protocol: 'http:', origin: 'http://server' },
})
export const sheet = Object.assign(new Target(), {
  baseURI: PAGE,
  documentElement: { lang: 'en' },
  visibilityState: 'visible',
  hidden: false,
  hasFocus: () => true,
})

/** What the server answers: a body, or a function that is called and may be waited for. */
export const answers: {
  method: string
  path: RegExp
  give: (request: Request) => unknown
}[] = []
export const requests: Request[] = []

async function answer(input: RequestInfo | URL, init?: RequestInit): Promise<Response> {
  const request = new PageRequest(input, init)
  requests.push(request)
  const { pathname } = new URL(request.url)
  const found = answers.find((each) => each.method === request.method && each.path.test(pathname))
  if (!found) return Response.json({ type: 'about:blank', detail: pathname }, { status: 404 })
  const given = await found.give(request)
  return given instanceof Response ? given : Response.json(given ?? null)
}

vi.stubGlobal('window', page)
vi.stubGlobal('document', sheet)
vi.stubGlobal('location', page.location)
vi.stubGlobal('localStorage', new Storage())
vi.stubGlobal('sessionStorage', new Storage())
vi.stubGlobal('Worker', Worker)
vi.stubGlobal('Request', PageRequest)
vi.stubGlobal('fetch', answer)
vi.stubGlobal('requestAnimationFrame', () => 0)
vi.stubGlobal('cancelAnimationFrame', () => {})
