/**
 * What the page needs of a browser that happy-dom lacks: a worker that records what is posted to it,
 * and a server that a test answers for. To be imported before everything else, by a test that begins
 * with `// @vitest-environment happy-dom`.
 */
import { MantineProvider } from '@mantine/core'
import { act, cleanup, configure, render, type RenderResult } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import type { ReactElement, ReactNode } from 'react'
import { afterEach } from 'vitest'
import { themeWith } from '../app/styles/theme'

// Behind a proxy's path, where an address without it leads nowhere.
const PLACE = 'http://bench/station/'
const API = '/station/api/v1'

export interface Asked {
  method: string
  /** Path and query, below the path of the API. */
  path: string
  headers: Headers
  /** Of JSON, else as text; null where there is none. */
  body: unknown
}

/** A body, the status of a refusal, or the whole response. */
type Answer = object | number | null
type Server = (asked: Asked) => Answer | Promise<Answer>

let server: Server = () => 404

/** Everything that the page asked for, in order. */
export const asked: Asked[] = []

/** The newest request to a path that ends so. */
export const sent = (path: string): Asked | undefined =>
  asked.filter((each) => each.path.endsWith(path)).at(-1)

/** Answer the page's requests from now on. */
export function serve(next: Server): void {
  server = next
  asked.length = 0
}

/** A refusal of the server. */
export const refusal = (status: number, part: object = {}) => ({
  type: 'urn:servodeck:not-allowed',
  title: '',
  status,
  detail: `refused with ${status}`,
  ...part,
})

/** An answer that a test gives later. */
export function later<T>(): { promise: Promise<T>; give: (answer: T) => void } {
  let give: (answer: T) => void = () => {}
  const promise = new Promise<T>((resolve) => {
    give = resolve
  })
  return { promise, give }
}

function json(text: string): unknown {
  try {
    return JSON.parse(text)
  } catch {
    return text
  }
}

async function answered(input: RequestInfo | URL, init?: RequestInit): Promise<Response> {
  const request = new Request(input, init)
  const url = new URL(request.url)
  const text = await request.text()
  const one = {
    method: request.method,
    path: `${url.pathname.replace(API, '')}${url.search}`,
    headers: request.headers,
    body: text === '' ? null : json(text),
  }
  asked.push(one)
  const found = await server(one)
  if (found instanceof Response) return found
  const body = typeof found === 'number' ? refusal(found) : found
  const status = body && 'status' in body && typeof body.status === 'number' ? body.status : 200
  return Response.json(body, { status })
}

/** What the page posted to its worker, in order. */
export const posted: { kind: string }[] = []

class RecordingWorker {
  onmessage: unknown = null
  postMessage(message: { kind: string }): void {
    posted.push(message)
  }
}

/** A surface on which nothing is drawn: everything can be called, and nothing has a size. */
function surface(): object {
  return new Proxy(
    {},
    {
      get: (_, name) => (name === 'measureText' ? () => ({ width: 0 }) : () => undefined),
      set: () => true,
    },
  )
}

;(window as unknown as { happyDOM: { setURL(url: string): void } }).happyDOM.setURL(PLACE)
Object.assign(globalThis, {
  fetch: answered,
  Worker: RecordingWorker,
  Path2D: surface,
  IS_REACT_ACT_ENVIRONMENT: true,
})
// Text fields that grow measure again when fonts have come.
Object.defineProperty(document, 'fonts', { value: new EventTarget() })
HTMLCanvasElement.prototype.getContext = surface as never
afterEach(cleanup)
// What a form waits for until it asks takes longer on a busy machine.
configure({ asyncUtilTimeout: 20_000 })

/** A component in the library's provider, as the page has it, but without transitions. */
function Provided({ children }: { children: ReactNode }) {
  return (
    <MantineProvider env="test" theme={themeWith('Close')}>
      {children}
    </MantineProvider>
  )
}

/** Show a component, and wait for what it asks for at once. */
export async function shown(element: ReactElement): Promise<RenderResult> {
  const result = render(element, { wrapper: Provided })
  await settled()
  return result
}

/** Turns of the event loop that an answer may take until it is shown. */
const TURNS = 5

/** Do something that comes from elsewhere than a person, and wait for what follows from it. */
export const settled = (work: () => unknown = () => {}): Promise<void> =>
  act(async () => {
    await work()
    for (let turn = 0; turn < TURNS; turn++) await new Promise((resolve) => setTimeout(resolve))
  })

/** Replace the text of a field. */
export async function type(field: HTMLElement, text: string): Promise<void> {
  await userEvent.clear(field)
  if (text !== '') await userEvent.type(field, text)
}
