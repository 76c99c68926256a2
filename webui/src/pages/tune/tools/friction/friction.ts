import type { FrictionResult } from '../../../../api/schema'

type Ripple = Pick<
  FrictionResult,
  'ripple_angle_deg' | 'compensation_percent' | 'ripple_forward_percent' | 'ripple_backward_percent'
>

/**
 * The table over one motor revolution, as `servodeck friction --table` writes it: place in rev,
 * torques in % of rated torque; a field is empty where no sample is.
 */
export function compensationCsv(result: Ripple): string {
  const rows = result.ripple_angle_deg.map((angle, i) =>
    [
      angle / 360,
      result.compensation_percent[i],
      result.ripple_forward_percent[i],
      result.ripple_backward_percent[i],
    ]
      .map((each) => each?.toFixed(6) ?? '')
      .join(','),
  )
  return ['position_rev,torque_percent,forward_percent,backward_percent', ...rows, ''].join('\n')
}
