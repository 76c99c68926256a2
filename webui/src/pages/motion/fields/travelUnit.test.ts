import { describe, expect, it } from 'vitest'
import type { AxisRecordInfo, AxisState } from '../../../api/schema'
import { placeIn, possibleUnits, roundedUp, startIn, travelUnit } from './travelUnit'

const TURNS = { units: { position: 'rev', velocity: 'rpm', acceleration: 'rpm/s' } } as unknown
const COUNTS = { units: { position: 'inc', velocity: 'inc/s', acceleration: 'inc/s²' } } as unknown
const state = TURNS as AxisState
const screw = { travel_unit: 'mm', travel_per_motor_turn: 10 / 3 } as AxisRecordInfo

describe('the unit that motions are typed in', () => {
  it('offers the travel of the load where mechanics are kept', () => {
    expect(possibleUnits(null, state)).toEqual(['rev'])
    expect(possibleUnits({ ...screw, travel_per_motor_turn: null }, state)).toEqual(['rev'])
    expect(possibleUnits(screw, state)).toEqual(['rev', 'mm'])
    expect(possibleUnits({ ...screw, travel_unit: '°' }, state)).toEqual(['rev', '°'])
  })
  it('offers none where the axis does not know its turns', () => {
    expect(possibleUnits(screw, COUNTS as AxisState)).toEqual(['rev'])
    expect(travelUnit('mm', screw, COUNTS as AxisState).units.position).toBe('inc')
  })
  it('falls back to revolutions when the chosen unit is gone', () => {
    expect(travelUnit('mm', null, state).name).toBe('rev')
    expect(travelUnit('°', screw, state).name).toBe('rev')
  })
  it('shows what the server reports in revolutions and rpm', () => {
    const unit = travelUnit('mm', screw, state)
    expect(unit.units).toMatchObject({
      position: 'mm',
      velocity: 'mm/s',
      acceleration: 'mm/s²',
    })
    expect(unit.travel(3)).toBeCloseTo(10)
    expect(unit.speed(360)).toBeCloseTo(20)
  })
  it('starts with numbers that mean the same movement', () => {
    const unit = travelUnit('mm', screw, state)
    expect(startIn(travelUnit('rev', screw, state), 'velocity', 60)).toBe(60)
    expect(startIn(unit, 'velocity', 60)).toBe(3.3)
    expect(startIn(unit, 'position', 5)).toBe(17)
    expect(startIn(travelUnit('rev', null, COUNTS as AxisState), 'velocity', 60)).toBeNull()
    expect(startIn(travelUnit('rev', null, null), 'velocity', 60)).toBeUndefined()
  })
  it('starts with an acceleration that the drive can do, rounded to no less', () => {
    // DS_C: 1500 rpm/s; on this screw 1500 / 60 × 10 / 3 = 83.33 mm/s².
    const slow = { ...screw, gentlest_ramp_rpm_s: 1500 }
    const unit = travelUnit('mm', slow, state)
    expect(unit.gentlest).toBeCloseTo(83.333, 3)
    expect(startIn(unit, 'acceleration', 600)).toBe(84)
    expect(startIn(unit, 'acceleration', 6000)).toBe(330)
    expect(startIn(travelUnit('rev', slow, state), 'acceleration', 600)).toBe(1500)
    expect(startIn(travelUnit('rev', screw, state), 'acceleration', 600)).toBe(600)
    expect(startIn(travelUnit('rev', slow, state), 'velocity', 60)).toBe(60)
    expect([roundedUp(83.333, 4), roundedUp(99.96, 2), roundedUp(1500, 4)]).toEqual([
      83.34, 100, 1500,
    ])
  })
  it('never remembers a number of one unit as one of another', () => {
    expect(placeIn(travelUnit('rev', screw, state), 'jog.speed')).toBe('jog.speed')
    expect(placeIn(travelUnit('mm', screw, state), 'jog.speed')).toBe('jog.speed.mm')
  })
})
