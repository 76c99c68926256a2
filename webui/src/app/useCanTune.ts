import { useEffect, useState } from 'react'
import { api, ask } from '../api/client'
import { useAxisState, useDrive, useLink } from '../live/store'

/** CiA 402 modes that a measurement commands in every cycle: CSP, CSV, CST. */
const CYCLIC_MODES = [8, 9, 10]

/** Whether an axis can be measured: a cyclic mode, and a bus that can exchange process data. */
export function useCanTune(drive: string | null): boolean {
  const { open } = useLink()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const urls = summary?.ports.map((port) => port.url).join(' ') ?? ''
  const [possible, setPossible] = useState(false)
  useEffect(() => {
    if (!open || urls === '') {
      setPossible(false)
      return
    }
    let current = true
    ask(api.GET('/api/v1/buses')).then(
      (buses) =>
        current &&
        setPossible(buses.some((bus) => bus.cyclic_possible && urls.split(' ').includes(bus.url))),
      () => {}, // asked again when the connection is back
    )
    return () => {
      current = false
    }
  }, [open, urls])
  return possible && (state?.modes.some((mode) => CYCLIC_MODES.includes(mode)) ?? false)
}
