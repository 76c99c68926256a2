import type { AxisRecordInfo, AxisState } from '../../api/schema'

/** Position and speed of the load, where the mechanics are known and the axis counts in turns. */
export function travelOf(
  record: AxisRecordInfo | null,
  state: AxisState | null,
): { name: 'position' | 'velocity'; value: string; unit: string }[] {
  const perTurn = record?.travel_per_motor_turn
  if (!record || perTurn == null || !state) return []
  const found: { name: 'position' | 'velocity'; value: string; unit: string }[] = []
  if (state.position !== null && state.units.position === 'rev') {
    const value = (state.position * perTurn).toFixed(3).replace('-', '−')
    found.push({ name: 'position', value, unit: record.travel_unit })
  }
  if (state.velocity !== null && state.units.velocity === 'rpm') {
    const value = ((state.velocity / 60) * perTurn).toFixed(2).replace('-', '−')
    found.push({ name: 'velocity', value, unit: `${record.travel_unit}/s` })
  }
  return found
}
