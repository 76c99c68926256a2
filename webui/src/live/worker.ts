/// <reference lib="webworker" />
import { DeadMan, RENEW_MS } from './deadman'
import { ScopeStore } from './scope-store'
import { BEAT_MS, LiveSocket, type SocketLike } from './socket'
import type { FromWorker, ToWorker } from './worker-messages'

const post = (message: FromWorker) => self.postMessage(message)
const scope = new ScopeStore()
let url = ''

const socket = new LiveSocket(() => new WebSocket(url) as unknown as SocketLike, {
  state: (state) => post({ kind: 'link', state }),
  message: (message) => {
    if (message.type === 'jog_ended' && deadMan.held === message.drive) deadMan.ended()
    post({ kind: 'message', message })
  },
  block: (data) => scope.block(data),
  closed: () => deadMan.ended(),
})
const deadMan = new DeadMan(
  (message) => socket.send(message),
  () => performance.now(),
)

setInterval(() => deadMan.tick(), RENEW_MS)
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
    case 'scopeStart':
      scope.add(request.message.subscription, request.message.channels.length)
      socket.stand(`scope ${request.message.subscription}`, request.message)
      break
    case 'scopeStop':
      socket.stand(`scope ${request.subscription}`, null)
      socket.send({ type: 'scope_stop', subscription: request.subscription })
      scope.remove(request.subscription)
      break
    case 'scopeClear':
      scope.clear()
      break
    case 'trigger':
      scope.setTrigger(request.trace, request.settings)
      break
    case 'view':
      post({ kind: 'frame', id: request.id, frame: scope.frame(request.view) })
      break
    case 'csv':
      post({
        kind: 'csv',
        id: request.id,
        text: scope.csv(request.traces, request.names, request.from, request.to),
      })
      break
  }
}
