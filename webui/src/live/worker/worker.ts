/// <reference lib="webworker" />
import { DeadMan, RENEW_MS } from './deadman'
import { EnablingHold } from './enabling'
import { ScopeStore } from '../scope/scope-store'
import { BEAT_MS, LiveSocket, type SocketLike } from './socket'
import type { FromWorker, ToWorker } from './worker-messages'

const post = (message: FromWorker) => self.postMessage(message)
let url = ''

const socket = new LiveSocket(() => new WebSocket(url) as unknown as SocketLike, {
  state: (state) => post({ kind: 'link', state }),
  message: (message) => {
    if (message.type === 'jog_ended' && deadMan.held === message.drive) deadMan.ended()
    post({ kind: 'message', message })
  },
  block: (data) => scope.block(data),
  closed: () => {
    deadMan.ended()
    enabling.ended()
    scope.interrupted()
  },
})
const scope = new ScopeStore({
  start: (message) => socket.stand(`scope ${message.subscription}`, message),
  stop: (subscription) => {
    socket.stand(`scope ${subscription}`, null)
    socket.send({ type: 'scope_stop', subscription })
  },
  changed: (numbers) => post({ kind: 'subscriptions', numbers }),
  triggered: (state) => post({ kind: 'triggered', state }),
  now: () => performance.now() / 1000,
})
const deadMan = new DeadMan(
  (message) => socket.send(message),
  () => performance.now(),
)

const enabling = new EnablingHold(
  (message) => socket.send(message),
  () => performance.now(),
  () => post({ kind: 'enableEnded' }),
)

setInterval(() => {
  deadMan.tick()
  if (deadMan.held !== null) post({ kind: 'jogAsked' })
  enabling.tick()
}, RENEW_MS)
setInterval(() => socket.beat(), BEAT_MS)

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const request = event.data
  switch (request.kind) {
    case 'open':
      url = request.url
      socket.connect()
      break
    case 'send':
      socket.send(request.message)
      break
    case 'stand':
      socket.stand(request.name, request.message)
      break
    case 'jogStart':
      if (!deadMan.start(request.message)) post({ kind: 'jogRefused' })
      break
    case 'jogBeat':
      deadMan.beat(request.drive)
      break
    case 'jogStop':
      deadMan.stop(request.reason)
      break
    case 'enablePress':
      enabling.press(request.invitation)
      break
    case 'enableBeat':
      enabling.beat()
      break
    case 'enableRelease':
      enabling.release(request.reason)
      break
    case 'scope':
      scope.configure(request.config)
      break
    case 'scopeClear':
      scope.clear()
      break
    case 'trigger':
      scope.setTrigger(request.trigger)
      break
    case 'ask':
      post({ kind: 'answer', id: request.id, answer: scope.answer(request.what, request.ask) })
      break
  }
}
