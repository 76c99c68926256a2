import { useRemembered } from '../../../widgets/browser/remembered'
import { placeIn, roundedUp, startIn, type TravelUnit } from './travelUnit'

/** A number and its setter, as the fields take them. */
export interface Typed {
  value: number | null
  min?: number
  onChange: (value: number | null) => void
  /** See NumberField. */
  onWrong?: (wrong: boolean) => void
}

/**
 * The numbers that every motion by speed is given, remembered for this drive, motion and unit:
 * 60 rpm, 600 rpm/s (or the gentlest ramp of the drive) and half the rated torque to begin with.
 */
export function useMotionNumbers(
  drive: string,
  unit: TravelUnit,
  motion: 'jog' | 'move' | 'sequence',
  travelRev: number,
): Record<'speed' | 'acceleration' | 'travel' | 'torque', Typed> {
  const place = (name: string) => placeIn(unit, `${motion}.${name}`)
  const start = startIn(unit, 'acceleration', 600)
  const acceleration = typed(useRemembered(drive, place('acceleration'), start))
  if (unit.gentlest !== null) {
    acceleration.min = roundedUp(unit.gentlest, 4)
    // Remembered from a drive that was replaced, or from before its limit was known.
    if ((acceleration.value ?? acceleration.min) < acceleration.min)
      acceleration.value = start ?? null
  }
  return {
    speed: typed(useRemembered(drive, place('speed'), startIn(unit, 'velocity', 60))),
    acceleration,
    travel: typed(useRemembered(drive, place('travel'), startIn(unit, 'position', travelRev))),
    torque: typed(useRemembered(drive, `${motion}.torque`, 50)),
  }
}

function typed([value, onChange]: [Typed['value'], Typed['onChange']]): Typed {
  return { value, onChange }
}
