import { api, ask } from './client'
import type {
  BrakeSettings,
  CycleSettings,
  DwellSettings,
  FirstPowerSettings,
  FrictionSettings,
  GantrySettings,
  HealthSettings,
  JobInfo,
  LoadSideSettings,
  SafetySettings,
  ShapingSettings,
  VibrationSettings,
} from './schema'

/** The settings of the tools whose forms come from the server, by their kinds. */
export interface ToolSettings {
  'brake-test': BrakeSettings
  cycle: CycleSettings
  dwell: DwellSettings
  'first-power': FirstPowerSettings
  friction: FrictionSettings
  gantry: GantrySettings
  health: HealthSettings
  'load-side': LoadSideSettings
  'safety-check': SafetySettings
  shaping: ShapingSettings
  vibration: VibrationSettings
}

/** Starts a tool as a job on a drive. */
export function startTool<K extends keyof ToolSettings>(
  kind: K,
  drive: string,
  settings: ToolSettings[K],
): Promise<JobInfo> {
  // The routes of the tools differ in their settings alone, which `K` ties to the kind.
  const path = `/api/v1/drives/{drive_id}/jobs/${kind}` as '/api/v1/drives/{drive_id}/jobs/friction'
  const body = settings as FrictionSettings
  return ask(api.POST(path, { params: { path: { drive_id: drive } }, body }))
}
