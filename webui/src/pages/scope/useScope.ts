import { useCallback, useEffect, useMemo, useRef, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { NamedSetup, Problem, ScopeSetup, SnapshotInfo } from '../../api/schema'
import * as live from '../../live/live'
import { contents, useLink, useStore } from '../../live/store'
import type { ScopeFrame, ScopeView } from '../../live/worker/worker-messages'
import { useSayOf } from '../../widgets/profile-text/texts'
import { configOf, EMPTY, type Infos, storedSetup, storeSetup, triggerOf } from './setup/setup'

/** Another set-up, or what becomes of the present one. */
export type ChangeSetup = (next: ScopeSetup | ((now: ScopeSetup) => ScopeSetup)) => void

/** The set-up of this browser, kept from visit to visit. */
export function useSetup(): [ScopeSetup, ChangeSetup, boolean] {
  const [setup, setSetup] = useState(() => storedSetup() ?? EMPTY)
  const [fresh, setFresh] = useState(() => storedSetup() === null)
  const latest = useRef(setup)
  const change = useCallback<ChangeSetup>((next) => {
    // Several changes may come before the page is rendered again: none takes another one back.
    latest.current = typeof next === 'function' ? next(latest.current) : next
    storeSetup(latest.current)
    setFresh(false)
    setSetup(latest.current)
  }, [])
  return [setup, change, fresh]
}

export const useScopeInfo = () => useStore('scopeInfo', () => contents.scopeInfo)

/** What can be drawn, by drive and key, with names in the page's language. */
export function useScopeChannels(): Infos {
  const channels = useStore('scopeInfo', () => contents.scopeChannels)
  const say = useSayOf()
  return useMemo(
    () =>
      new Map(
        [...channels].map(([place, info]) => {
          const drive = place.slice(0, place.lastIndexOf(' '))
          return [place, { ...info, name: say(drive, info.name) }]
        }),
      ),
    [channels, say],
  )
}

/**
 * Samples what the set-up names while the page shows, and beyond that while a trigger is armed:
 * who starts a motion on another page comes back to what it caught.
 */
export function useSampling(setup: ScopeSetup, infos: Infos): void {
  const config = configOf(setup, infos)
  const armed = useRef(false)
  armed.current = setup.trigger.mode !== 'off'
  useEffect(() => {
    live.toScope({ kind: 'scope', config })
    // The text stands for the configuration.
  }, [JSON.stringify(config)])
  useEffect(
    () => () => {
      if (!armed.current) {
        live.toScope({ kind: 'scope', config: { sources: [], maths: [], period: 0 } })
      }
    },
    [],
  )
}

/** The trigger that the worker looks for, as text. */
let sought = 'null'

/** Arms the trigger; `arming` arms it again. One that was armed before the page was left stays. */
export function useTrigger(setup: ScopeSetup, infos: Infos, arming: number): void {
  const trigger = triggerOf(setup, infos)
  const text = JSON.stringify(trigger)
  useEffect(() => {
    if (text === sought && arming === 0) return
    sought = text
    live.toScope({ kind: 'trigger', trigger })
    // The text stands for the trigger.
  }, [text, arming])
}

/** Part of the period that a page rests after a picture, however long that took. */
const LEAST_REST = 0.25

/** Asks the worker for a picture every `period` ms, and at once when the view changes. */
export function useFrames(
  view: () => ScopeView | null,
  period: number,
  change: string,
  onFrame: (frame: ScopeFrame) => void,
): void {
  const latest = useRef({ view, onFrame })
  latest.current = { view, onFrame }
  useEffect(() => {
    let alive = true
    let timer: ReturnType<typeof setTimeout> | undefined
    const round = async () => {
      const began = performance.now()
      const wanted = latest.current.view()
      if (wanted) {
        const frame = await live.askScope('view', wanted)
        if (!alive) return
        latest.current.onFrame(frame)
      }
      // One picture at a time, with a rest between: a slow page asks less often instead of
      // falling behind, leaves half of its time to others, and is always free to hear STOP.
      const took = performance.now() - began
      const rest = Math.max(period * LEAST_REST, period - took, took)
      if (alive) timer = setTimeout(() => requestAnimationFrame(() => void round()), rest)
    }
    void round()
    return () => {
      alive = false
      clearTimeout(timer)
    }
  }, [period, change])
}

/** Set-ups and snapshots that the server keeps. */
export function useStored() {
  const { open } = useLink()
  const [setups, setSetups] = useState<NamedSetup[]>([])
  const [snapshots, setSnapshots] = useState<SnapshotInfo[]>([])
  const [problem, setProblem] = useState<Problem | null>(null)
  const refresh = useCallback(async () => {
    try {
      setSetups(await ask(api.GET('/api/v1/scope/setups')))
      setSnapshots(await ask(api.GET('/api/v1/scope/snapshots')))
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
  }, [])
  useEffect(() => {
    if (open) void refresh()
  }, [open, refresh])
  return { setups, snapshots, refresh, problem }
}
