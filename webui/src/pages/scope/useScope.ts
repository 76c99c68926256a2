import { useEffect, useRef, useState } from 'react'
import * as live from '../../live/live'
import { contents, useStore } from '../../live/store'
import type { TriggerSettings } from '../../live/trigger'
import type { ScopeFrame, ScopeView, TraceRef } from '../../live/worker-messages'
import { byDrive, type Channel } from './channels'

let counter = 0
const FRAME_MS = 40

/** Subscribes to the channels for as long as the page shows; gives each its trace. */
export function useSubscriptions(channels: Channel[], period: number): TraceRef[] {
  const [traces, setTraces] = useState<TraceRef[]>([])
  const shape = JSON.stringify([channels, period])
  useEffect(() => {
    const mine: number[] = []
    const refs = new Map<Channel, TraceRef>()
    for (const group of byDrive(channels).values()) {
      const subscription = ++counter
      mine.push(subscription)
      group.forEach((channel, i) => {
        refs.set(channel, { subscription, channel: i })
      })
      live.toScope({
        kind: 'scopeStart',
        message: { type: 'scope_start', subscription, channels: group, period_s: period },
      })
    }
    setTraces(channels.flatMap((channel) => refs.get(channel) ?? []))
    return () => {
      for (const subscription of mine) live.toScope({ kind: 'scopeStop', subscription })
    }
    // `shape` stands for channels and period.
  }, [shape])
  return traces
}

export const useScopeInfo = () => useStore('scopeInfo', () => contents.scopeInfo)

/** Asks the worker for a picture again and again while `running`, and once when the view changes. */
export function useFrames(
  view: () => ScopeView | null,
  running: boolean,
  change: string,
  onFrame: (frame: ScopeFrame) => void,
): void {
  const latest = useRef({ view, onFrame })
  latest.current = { view, onFrame }
  useEffect(() => {
    let alive = true
    let timer: ReturnType<typeof setTimeout> | undefined
    const round = async () => {
      const wanted = latest.current.view()
      if (wanted) {
        const frame = await live.scopeFrame(wanted)
        if (!alive) return
        latest.current.onFrame(frame)
      }
      // One picture at a time: a slow page asks less often instead of falling behind.
      if (alive && running)
        timer = setTimeout(() => requestAnimationFrame(() => void round()), FRAME_MS)
    }
    void round()
    return () => {
      alive = false
      clearTimeout(timer)
    }
  }, [running, change])
}

export function useTrigger(trace: TraceRef | null, settings: TriggerSettings | null): void {
  const shape = JSON.stringify([trace, settings])
  useEffect(() => {
    live.toScope({ kind: 'trigger', trace: settings ? trace : null, settings })
    return () => live.toScope({ kind: 'trigger', trace: null, settings: null })
    // `shape` stands for both.
  }, [shape])
}
