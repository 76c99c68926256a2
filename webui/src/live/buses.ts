import { useEffect } from 'react'
import { api, ask } from '../api/client'
import type { Bus } from '../api/schema'
import { contents, publish, subscribe, useStore } from './store'

export const PERIOD_MS = 2000

/** Opened buses with their counters, as the server listed them last. */
let buses: Bus[] = []
let watching = 0
let timer: ReturnType<typeof setInterval> | null = null
let request: Promise<void> | null = null

/** The list, asked for with one request at a time: whoever asks meanwhile waits for its answer. */
export function askBuses(): Promise<void> {
  if (request) return request
  const asked: Promise<void> = ask(api.GET('/api/v1/buses'))
    .then(
      (found) => {
        if (request !== asked) return
        buses = found
        publish('buses')
      },
      () => {}, // shown by the connection banner; the next period asks again
    )
    .finally(() => {
      if (request === asked) request = null
    })
  request = asked
  return asked
}

/** The list after a change: an answer that is already on its way may be older than the change. */
export async function refreshBuses(): Promise<void> {
  await request
  await askBuses()
}

/** Ask once per period while anybody watches and there is a connection. */
function adapt(): void {
  const { open } = contents.link
  // What was asked over a lost connection may stay without an answer for a minute.
  if (!open) request = null
  const wanted = watching > 0 && open
  if (wanted === (timer !== null)) return
  if (timer !== null) {
    clearInterval(timer)
    timer = null
    return
  }
  timer = setInterval(() => void askBuses(), PERIOD_MS)
  void askBuses()
}
subscribe('link', adapt)

/** Keep the list current; however many watch, it is asked for once per period. */
export function watchBuses(): () => void {
  watching += 1
  adapt()
  return () => {
    watching -= 1
    adapt()
  }
}

export const knownBuses = () => buses

/** Opened buses with their counters, kept current while a component that shows them is mounted. */
export function useBuses(): { buses: Bus[]; refresh: () => Promise<void> } {
  useEffect(watchBuses, [])
  return { buses: useStore('buses', knownBuses), refresh: refreshBuses }
}

/** The bus with process data among these addresses, by the list as it was answered last. */
export const useCyclicUrl = (urls: string[]) =>
  useStore(
    'buses',
    () => buses.find((each) => each.cyclic_possible && urls.includes(each.url))?.url ?? null,
  )
