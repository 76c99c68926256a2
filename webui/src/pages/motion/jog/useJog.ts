import { useEffect, useMemo, useRef, useState } from 'react'
import type { JogEnded, JogGap } from '../../../api/schema'
import * as live from '../../../live/live'
import { contents, subscribe } from '../../../live/store'
import { JogHold } from './jog-hold'
import type { TravelName } from '../fields/travelUnit'

export interface JogSettings {
  speed: number
  acceleration: number
  travel_limit: number
  torque_limit: number
  unit: TravelName
}

/** Hold-to-run for one axis. `settings` null: something is not valid, so nothing starts. */
export function useJog(drive: string, settings: JogSettings | null) {
  const [direction, setDirection] = useState<-1 | 1 | null>(null)
  const [ended, setEnded] = useState<JogEnded | null>(null)
  /** From the press until the server says that the jog has ended. */
  const [begun, setBegun] = useState(false)
  /** The last gap in the signs of life of this hold. */
  const [gap, setGap] = useState<JogGap | null>(null)
  const latest = useRef(settings)
  latest.current = settings
  const hold = useMemo(
    () =>
      new JogHold(
        {
          start: (towards) => {
            setEnded(null)
            setGap(null)
            if (latest.current) {
              setBegun(true)
              const asked = { drive, direction: towards, press: 0, ...latest.current }
              live.jogStart({ type: 'jog_start', ...asked })
            }
          },
          beat: () => live.jogBeat(drive),
          stop: (reason) => live.jogStop(reason),
          changed: setDirection,
        },
        {
          isVisible: () => document.visibilityState === 'visible',
          hasFocus: () => document.hasFocus(),
          requestFrame: (callback) => requestAnimationFrame(callback),
          cancelFrame: (id) => cancelAnimationFrame(id),
          now: () => performance.now(),
        },
      ),
    [drive],
  )
  useEffect(() => {
    const hidden = () => document.visibilityState !== 'visible' && hold.release('page-hidden')
    const frozen = () => hold.release('page-hidden')
    const blur = () => hold.release('focus-lost')
    const leave = () => hold.release('page-left')
    const key = (event: KeyboardEvent) => event.key === 'Escape' && hold.release('escape')
    const lost = subscribe('link', () => !contents.link.open && hold.release('connection-lost'))
    const refused = subscribe('jogRefused', () => hold.release('connection-lost'))
    const asked = subscribe('jogAsked', () => hold.asked())
    const paused = subscribe('jogGap', () => {
      if (contents.jogGap?.drive === drive) setGap(contents.jogGap)
    })
    const over = subscribe('jogEnded', () => {
      if (contents.jogEnded?.drive !== drive) return
      setEnded(contents.jogEnded)
      setBegun(false)
      hold.release('released')
    })
    const turnedDown = subscribe('refused', () => {
      if (contents.refused?.request !== 'jog_start') return
      setBegun(false)
      hold.release('released')
    })
    document.addEventListener('visibilitychange', hidden)
    window.addEventListener('blur', blur)
    window.addEventListener('pagehide', leave)
    document.addEventListener('freeze', frozen)
    window.addEventListener('keydown', key, { capture: true })
    return () => {
      hold.release('axis-changed')
      setBegun(false)
      for (const end of [lost, refused, asked, paused, over, turnedDown]) end()
      document.removeEventListener('visibilitychange', hidden)
      window.removeEventListener('blur', blur)
      window.removeEventListener('pagehide', leave)
      document.removeEventListener('freeze', frozen)
      window.removeEventListener('keydown', key, { capture: true })
    }
  }, [drive, hold])
  return {
    direction,
    ended,
    gap,
    ending: begun && direction === null,
    hold,
    press: (to: -1 | 1) => latest.current !== null && hold.press(to),
  }
}
