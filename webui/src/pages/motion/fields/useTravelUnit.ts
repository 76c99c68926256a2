import { useState } from 'react'
import type { AxisState } from '../../../api/schema'
import { keep, kept } from '../../../widgets/browser/kept'
import { useRecord } from '../../../widgets/drive/useFunctions'
import { possibleUnits, type TravelName, travelUnit } from './travelUnit'

/** The unit of an axis' motions, kept in this browser. */
export function useTravelUnit(drive: string, state: AxisState | null) {
  const record = useRecord(drive)
  const place = `servodeck.${drive}.motion.unit`
  const [choices, setChoices] = useState<Record<string, string>>({})
  const chosen = choices[place] ?? kept(place) ?? 'rev'
  return {
    unit: travelUnit(chosen, record, state),
    possible: possibleUnits(record, state),
    choose: (name: TravelName) => {
      keep(place, name)
      setChoices((old) => ({ ...old, [place]: name }))
    },
  }
}
