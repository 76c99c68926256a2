import { useEffect, useState } from 'react'
import { api, ask } from '../api/client'
import { useAxisState, useDrive, useLink } from '../live/store'
import { measurable } from '../pages/response/measurable'

/** Whether an axis can be measured over a bus that it is connected to. */
export function useCanTune(drive: string | null): boolean {
  const { open } = useLink()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const urls = summary?.ports.map((port) => port.url).join(' ') ?? ''
  const [url, setUrl] = useState<string | null>(null)
  useEffect(() => {
    setUrl(null)
    if (!open || urls === '') return
    let current = true
    ask(api.GET('/api/v1/buses')).then(
      (buses) => {
        const bus = buses.find((each) => each.cyclic_possible && urls.split(' ').includes(each.url))
        if (current) setUrl(bus?.url ?? null)
      },
      () => {}, // asked again when the connection is back
    )
    return () => {
      current = false
    }
  }, [open, urls])
  return measurable(url, state?.modes ?? []).possible
}
