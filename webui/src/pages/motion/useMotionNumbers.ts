import { useRemembered } from './remembered'
import { placeIn, startIn, type TravelUnit } from './travelUnit'

/** A number and its setter, as the fields take them. */
export interface Typed {
  value: number | null
  onChange: (value: number | null) => void
}

/**
 * The numbers that every motion by speed is given, remembered for this drive, motion and unit:
 * 60 rpm, 600 rpm/s and half the rated torque to begin with.
 */
export function useMotionNumbers(
  drive: string,
  unit: TravelUnit,
  motion: 'jog' | 'move' | 'sequence',
  travelRev: number,
): Record<'speed' | 'acceleration' | 'travel' | 'torque', Typed> {
  const place = (name: string) => placeIn(unit, `${motion}.${name}`)
  return {
    speed: typed(useRemembered(drive, place('speed'), startIn(unit, 'velocity', 60))),
    acceleration: typed(
      useRemembered(drive, place('acceleration'), startIn(unit, 'acceleration', 600)),
    ),
    travel: typed(useRemembered(drive, place('travel'), startIn(unit, 'position', travelRev))),
    torque: typed(useRemembered(drive, `${motion}.torque`, 50)),
  }
}

function typed([value, onChange]: [Typed['value'], Typed['onChange']]): Typed {
  return { value, onChange }
}
