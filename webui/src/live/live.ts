import { API_ROOT, api, ask, setConnection } from '../api/client'
import type { FromPage, JogStart, JogStop, ToPage } from '../api/schema'
import { addChat, addNotice, setCursor, setPeople, setPointer } from './people'
import { forgetServerClock, heardServerTime } from './server-clock'
import * as store from './store'
import type { FromWorker, QuestionKind, Questions, ToWorker } from './worker/worker-messages'

const worker = new Worker(new URL('./worker/worker.ts', import.meta.url), { type: 'module' })
const post = (message: ToWorker) => worker.postMessage(message)

let asked = 0
const waiting = new Map<number, (answer: never) => void>()

let started = false

/** Open the connection for good. */
export function start(): void {
  if (started) return
  started = true
  const { protocol, host } = window.location
  post({ kind: 'open', url: `${protocol.replace('http', 'ws')}//${host}${API_ROOT}/api/v1/live` })
}

export const send = (message: FromPage) => post({ kind: 'send', message })
export const stand = (name: string, message: FromPage | null) =>
  post({ kind: 'stand', name, message })
export function jogStart(message: JogStart): void {
  store.askedAgain('jog_start')
  post({ kind: 'jogStart', message })
}
export const jogBeat = (drive: string) => post({ kind: 'jogBeat', drive })
export const jogStop = (reason: JogStop['reason']) => post({ kind: 'jogStop', reason })
export const enablePress = (invitation: string) => post({ kind: 'enablePress', invitation })
export const enableBeat = () => post({ kind: 'enableBeat' })
export const enableRelease = (reason: JogStop['reason']) => post({ kind: 'enableRelease', reason })
export const toScope = (message: Extract<ToWorker, { kind: 'scope' | 'scopeClear' | 'trigger' }>) =>
  post(message)

/** Ask the worker about its samples. */
export function askScope<Kind extends QuestionKind>(
  what: Kind,
  ask: Questions[Kind]['ask'],
): Promise<Questions[Kind]['get']> {
  const id = ++asked
  return new Promise((resolve) => {
    waiting.set(id, resolve)
    post({ kind: 'ask', id, what, ask } as ToWorker)
  })
}

/**
 * Fetch what the websocket only shows about when it changes. The list of drives is not among
 * it: every connection begins with one, and an answer fetched here could be older.
 */
async function refresh(): Promise<void> {
  const before = store.runningJobs()
  try {
    const jobs = await ask(api.GET('/api/v1/jobs'))
    for (const job of jobs) store.setJob(job)
    store.endForgotten(before, jobs)
    await Promise.all([...store.contents.rows.keys()].map(loadRows))
  } catch {
    // The connection went again; its banner is already shown and the next one comes here.
  }
}

/** Descriptions and last readings of a drive's parameters. */
export async function loadRows(drive: string): Promise<void> {
  store.setRows(
    drive,
    await ask(
      api.GET('/api/v1/drives/{drive_id}/parameters', { params: { path: { drive_id: drive } } }),
    ),
  )
}

function receive(message: ToPage): void {
  switch (message.type) {
    case 'hello':
      forgetServerClock()
      setConnection(message.connection)
      store.contents.connection = message.connection
      void refresh()
      break
    case 'state':
      store.setState(message.state, true)
      // The time of one that is not fresh is that of the last answer of the drive.
      if (message.state.fresh) heardServerTime(message.state.time)
      break
    case 'drives':
      for (const drive of store.setDrives(message.drives)) void loadRows(drive).catch(() => {})
      break
    case 'values':
      store.setReadings(message.drive, message.values, true)
      break
    case 'job':
      if (message.job.ended !== null) heardServerTime(message.job.ended)
      store.setJob(message.job)
      break
    case 'jog_ended':
      store.contents.jogEnded = message
      store.publish('jogEnded')
      break
    case 'jog_gap':
      store.contents.jogGap = message
      store.publish('jogGap')
      break
    case 'scope_info':
      store.setScopeInfo(message)
      break
    case 'log':
      store.addLog([message.entry])
      heardServerTime(message.entry.time)
      break
    case 'refused':
      store.contents.refused = { ...message, at: Date.now() }
      store.publish('refused')
      break
    case 'stop_taken':
      store.contents.stopTaken = { press: message.press }
      store.publish('stopTaken')
      break
    case 'stop_result':
      store.contents.stopReached = { press: message.press, result: message.result }
      store.publish('stopReached')
      break
    case 'pong':
      break
    case 'people':
      setPeople(message)
      break
    case 'lease_notice':
      addNotice(message)
      break
    case 'pointer_moved':
      setPointer(message)
      break
    case 'cursor_moved':
      setCursor(message)
      break
    case 'chat_said':
      addChat([message])
      break
  }
}

/** Called when the connection does not come back: the server may not know us any more. */
let onRefused: () => void = () => {}
export function whenRefused(act: () => void): void {
  onRefused = act
}

worker.onmessage = (event: MessageEvent<FromWorker>) => {
  const answer = event.data
  switch (answer.kind) {
    case 'link':
      if (!answer.state.open && answer.state.attempt > 0) onRefused()
      store.setLink(answer.state, Date.now())
      break
    case 'message':
      receive(answer.message)
      break
    case 'jogAsked':
      store.publish('jogAsked')
      break
    case 'jogRefused':
      store.publish('jogRefused')
      break
    case 'enableEnded':
      store.publish('enableEnded')
      break
    case 'subscriptions':
      store.keepScopeInfo(answer.numbers)
      break
    case 'triggered':
      store.contents.trigger = answer.state
      store.publish('trigger')
      break
    case 'answer':
      waiting.get(answer.id)?.(answer.answer as never)
      waiting.delete(answer.id)
      break
  }
}
