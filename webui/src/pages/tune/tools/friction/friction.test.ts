import { describe, expect, it } from 'vitest'
import { compensationCsv } from './friction'

describe('the compensation table', () => {
  it('has a row for each place and an empty field where nothing was measured', () => {
    const table = compensationCsv({
      ripple_angle_deg: [90, 270],
      compensation_percent: [0.5, -0.5],
      ripple_forward_percent: [0.6, null],
      ripple_backward_percent: [0.4, -0.4],
    })
    expect(table.split('\n')).toEqual([
      'position_rev,torque_percent,forward_percent,backward_percent',
      '0.250000,0.500000,0.600000,0.400000',
      '0.750000,-0.500000,,-0.400000',
      '',
    ])
  })
})
