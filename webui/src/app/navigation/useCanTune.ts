import { useEffect } from 'react'
import { askBuses, useCyclicUrl } from '../../live/buses'
import { useAxisState, useDrive, useLink } from '../../live/store'
import { measurable } from '../../pages/response/measure/measurable'

/** Whether an axis can be measured over a bus that it is connected to. */
export function useCanTune(drive: string | null): boolean {
  const { open } = useLink()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const urls = summary?.ports.map((port) => port.url) ?? []
  const url = useCyclicUrl(urls)
  const ports = urls.join(' ')
  useEffect(() => {
    if (open && ports !== '') void askBuses() // asked again when the connection is back
  }, [open, ports])
  return measurable(open ? url : null, state?.modes ?? []).possible
}
