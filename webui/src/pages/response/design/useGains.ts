import { api, ask } from '../../../api/client'
import type { GainInfo, GainValues } from '../../../api/schema'
import { useFetched } from '../../../widgets/drive/useFunctions'

/** Loop gains of a drive, read from it. */
export function useGains(drive: string) {
  const { data, problem, read } = useFetched<GainInfo>(
    () =>
      ask(api.GET('/api/v1/drives/{drive_id}/gains', { params: { path: { drive_id: drive } } })),
    [drive],
  )
  return { gains: problem ? null : data, problem, read }
}

/** Gains that a loop can be predicted with, or null where one has no known meaning. */
export function usable(gains: GainInfo | null): GainValues | null {
  if (!gains?.speed_hz || !gains.integral_hz || !gains.position_1_s || !gains.inertia_kgm2) {
    return null
  }
  return {
    speed_bandwidth_hz: legible(gains.speed_hz),
    integral_hz: legible(gains.integral_hz),
    position_1_s: legible(gains.position_1_s),
    inertia_kgm2: legible(gains.inertia_kgm2),
  }
}

const legible = (value: number) => Number(value.toPrecision(4))
