import { API_ROOT } from '../../api/client'
import type { StopResult } from '../../api/schema'
import * as live from '../../live/live'
import { contents, publish, subscribe } from '../../live/store'

/** What the last STOP reached. `null` answer: the server has not answered yet. */
interface StopReport {
  at: number
  /** Number of the press on this page: an answer to an earlier one does not count for it. */
  press: number
  answer: StopResult | null
  /** Set when neither way to the server worked, or nothing says that one did. */
  failure: string | null
  /** The quick stop has gone out; whether the axes stand is being measured. */
  taken: boolean
}

/**
 * The quick stop goes out within less than this. On a network that loses everything a
 * request waits for minutes, and a person at the machine must not.
 */
const TAKEN_MS = 3000

let report: StopReport | null = null
/** The press whose request has neither an answer nor an error yet. */
let waiting: number | null = null

export const currentReport = () => report

let pressed = -Infinity
let presses = 0

/** When STOP was last pressed on this page. */
export const pressedAt = () => pressed

export function dismissReport(): void {
  report = null
  publish('stop')
}

/**
 * STOP, all axes. Two ways at once, since either may be blocked: the open websocket (from the
 * worker) and a request of its own that nothing else in the page can hold up.
 */
export async function stopEverything(): Promise<void> {
  // First the request of its own: nothing that fails below can hold it back any more.
  const request = fetch(`${API_ROOT}/api/v1/stop`, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: '{}',
    keepalive: true,
    priority: 'high',
  })
  presses += 1
  const press = presses
  const mine: StopReport = { at: Date.now(), press, answer: null, failure: null, taken: false }
  pressed = mine.at
  try {
    live.send({ type: 'stop', drive: null, press })
    live.jogStop('stop')
  } catch (error) {
    console.error('STOP could not be sent over the websocket', error)
  }
  report = mine
  waiting = press
  publish('stop')
  setTimeout(() => {
    if (report?.press === press && !report.taken) reportUnknown()
  }, TAKEN_MS)
  try {
    const answer = await request
    if (!answer.ok) throw new Error(`HTTP ${answer.status}`)
    finish(mine, { answer: (await answer.json()) as StopResult, failure: null })
  } catch (error) {
    // The websocket may still have carried it; what it reached is not known, and that is said.
    finish(mine, {
      answer: null,
      failure: contents.link.open ? 'unknown' : `unreachable: ${String(error)}`,
    })
  }
}

/** The websocket shows at once that STOP went out, and its verdicts where the request is lost. */
export function listenForAnswers(): void {
  subscribe('stopTaken', () => {
    if (report === null || report.answer !== null) return
    if (contents.stopTaken?.press !== report.press) return
    // An answer that was missing has come; a request that failed is still a failure.
    report = { ...report, taken: true, failure: waiting === report.press ? null : report.failure }
    publish('stop')
  })
  subscribe('link', () => {
    if (!contents.link.open) reportUnknown()
  })
  subscribe('stopReached', () => {
    const reached = contents.stopReached
    if (report === null || report.answer !== null || reached?.press !== report.press) return
    report = { ...report, answer: reached.result, failure: null }
    publish('stop')
  })
}

/** No answer confirms that the axes stand: the page refers to the machine's emergency stop. */
function reportUnknown(): void {
  if (report === null || report.answer !== null || report.failure !== null) return
  report = { ...report, failure: 'unknown' }
  publish('stop')
}

function finish(mine: StopReport, result: Pick<StopReport, 'answer' | 'failure'>): void {
  if (waiting === mine.press) waiting = null
  if (report?.press !== mine.press) return
  // The verdicts have come by the websocket already.
  if (result.answer === null && report.answer !== null) return
  report = { ...mine, ...result }
  publish('stop')
}

/** Esc stops from everywhere, before any other handler of that key can keep it to itself. */
export function listenForEscape(): void {
  window.addEventListener(
    'keydown',
    (event) => {
      if (event.key === 'Escape' && !event.repeat && !event.isComposing) void stopEverything()
    },
    { capture: true },
  )
}
