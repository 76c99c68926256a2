import type { TouchProbe } from '../../api/schema'

/** Objects whose values the panel shows live. */
export function probeKeys(probe: TouchProbe | null): string[] {
  if (!probe) return []
  const latched = probe.probes.flatMap((each) => [each.rising_key, each.falling_key])
  return [probe.function_key, probe.status_key, ...latched.filter((key) => key != null)]
}

export interface ProbeSettings {
  on: boolean
  continuous: boolean
  source: number
  rising: boolean
  falling: boolean
}

/** The eight bits of one probe in 60B8h (CiA 402-2). */
export function probeSettings(raw: number, number: number): ProbeSettings {
  const bits = ((raw & 0xffff) >> (8 * (number - 1))) & 0xff
  return {
    on: (bits & 1) !== 0,
    continuous: (bits & 2) !== 0,
    source: (bits >> 2) & 3,
    rising: (bits & 0x10) !== 0,
    falling: (bits & 0x20) !== 0,
  }
}
