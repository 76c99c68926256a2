import { describe, expect, it } from 'vitest'
import { measurable } from './measurable'

describe('how an axis can be measured', () => {
  it('takes cyclic modes where there are some', () => {
    expect(measurable('ethercat://eth0', [1, 3, 8, 9, 10])).toEqual({
      possible: true,
      bySpeed: false,
      cycleMs: 1,
    })
  })
  it('takes the profile velocity over CANopen where there is none', () => {
    const found = measurable('canopen://slcan//dev/ttyACM0?bitrate=500000', [1, 3, 4, 6])
    expect(found).toEqual({ possible: true, bySpeed: true, cycleMs: 2 })
    expect(measurable('canopen://socketcan/can0', [1, 3, 4, 6]).cycleMs).toBe(1)
  })
  it('takes no profile velocity over other buses, and nothing without process data', () => {
    expect(measurable('ethercat://eth0', [1, 3, 4, 6]).possible).toBe(false)
    expect(measurable(null, [1, 3, 8]).possible).toBe(false)
  })
})
