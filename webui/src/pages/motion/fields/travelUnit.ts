import type { AxisRecordInfo, AxisState, MoveRequest } from '../../../api/schema'

export type TravelName = NonNullable<MoveRequest['unit']>

/**
 * The unit in which motions of an axis are typed and shown: revolutions, or travel of its load.
 *
 * Commands carry its name and the numbers as typed; the server converts them. Here only what the
 * server reports in revolutions is converted, to be shown.
 */
export interface TravelUnit {
  name: TravelName
  /** Units of the fields by quantity. */
  units: Record<string, string>
  travel: (revolutions: number) => number
  speed: (rpm: number) => number
  /**
   * The gentlest acceleration that the drive can do, in this unit; null where nothing bounds it.
   */
  gentlest: number | null
}

/** Units that this axis can be commanded in. */
export function possibleUnits(
  record: AxisRecordInfo | null,
  state: AxisState | null,
): TravelName[] {
  const turns = state?.units.position === 'rev' && state.units.velocity === 'rpm'
  const load = record?.travel_unit
  if (!turns || record?.travel_per_motor_turn == null) return ['rev']
  return load === 'mm' || load === '°' ? ['rev', load] : ['rev']
}

/** The chosen unit if the axis has it, else revolutions (or the drive's own units). */
export function travelUnit(
  chosen: string,
  record: AxisRecordInfo | null,
  state: AxisState | null,
): TravelUnit {
  const name = possibleUnits(record, state).find((each) => each === chosen) ?? 'rev'
  const perTurn = record?.travel_per_motor_turn
  const units = state?.units ?? {}
  const gentlest = record?.gentlest_ramp_rpm_s ?? null
  if (name === 'rev' || perTurn == null) {
    return { name: 'rev', units, travel: (rev) => rev, speed: (rpm) => rpm, gentlest }
  }
  return {
    name,
    units: {
      ...units,
      position: name,
      velocity: `${name}/s`,
      acceleration: `${name}/s²`,
      following_error: name,
    },
    travel: (rev) => rev * perTurn,
    speed: (rpm) => (rpm / 60) * perTurn,
    gentlest: gentlest === null ? null : (gentlest / 60) * perTurn,
  }
}

/**
 * A cautious first value, given in revolutions or rpm, in this unit; two digits are enough. Of an
 * acceleration one that the drive can do.
 */
export function startIn(
  unit: TravelUnit,
  quantity: 'position' | 'velocity' | 'acceleration',
  usual: number,
): number | null | undefined {
  const label = unit.units[quantity]
  if (label === undefined) return undefined
  if (unit.name === 'rev' && !['rev', 'rpm', 'rpm/s'].includes(label)) return null
  const least = quantity === 'acceleration' ? unit.gentlest : null
  const value = quantity === 'position' ? unit.travel(usual) : unit.speed(usual)
  if (least !== null && value < least) return roundedUp(least, 2)
  return unit.name === 'rev' ? usual : Number(value.toPrecision(2))
}

/** The next number of so many digits that is no less: a limit that was rounded down is none. */
export function roundedUp(value: number, digits: number): number {
  const near = Number(value.toPrecision(digits))
  if (near >= value) return near
  const step = 10 ** (Math.floor(Math.log10(value)) - digits + 1)
  return Number((near + step).toPrecision(digits))
}

/** Place of a remembered number: numbers of one unit are never mistaken for another. */
export function placeIn(unit: TravelUnit, name: string): string {
  return unit.name === 'rev' ? name : `${name}.${unit.name}`
}
