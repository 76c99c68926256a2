import { useOriginalRows } from '../../live/store'
import { DIGITAL_INPUTS, DIGITAL_OUTPUTS } from '../../widgets/parameters/objects'

/** Whether the drive has objects that the I/O page can show. */
export function useHasIo(drive: string | null): boolean {
  const rows = useOriginalRows(drive ?? '')
  return (
    rows?.some(
      (row) => row.reachable && (row.key === DIGITAL_INPUTS || row.key === DIGITAL_OUTPUTS),
    ) ?? false
  )
}
