import type { AxisState, DriveSummary } from '../../../api/schema'
import { useBuses } from '../../../live/buses'
import { type Measurable, measurable } from './measurable'

/** How an axis can be given a setpoint with every cycle of its bus, as it is connected now. */
export function useMeasurable(drive: DriveSummary | null, state: AxisState | null): Measurable {
  const { buses } = useBuses()
  const urls = drive?.ports.map((port) => port.url) ?? []
  const bus = buses.find((each) => each.cyclic_possible && urls.includes(each.url))
  return measurable(bus?.url ?? null, state?.modes ?? [])
}
