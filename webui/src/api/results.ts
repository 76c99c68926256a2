import type {
  BrakeResult,
  CycleResult,
  DwellResult,
  FirstPowerResult,
  FrictionResult,
  GantryResult,
  HealthResult,
  InertiaAnswer,
  JobInfo,
  LoadSideResult,
  SafetyResult,
  ShapingResult,
  StepAnswer,
  VibrationResult,
} from './schema'

/** What a tool concluded: distinguished by its field `tool`. */
type ToolOutcome =
  | BrakeResult
  | CycleResult
  | DwellResult
  | FirstPowerResult
  | FrictionResult
  | GantryResult
  | HealthResult
  | InertiaAnswer
  | LoadSideResult
  | SafetyResult
  | ShapingResult
  | StepAnswer
  | VibrationResult

/** The result of a tool, or null where it is something else. */
export const outcome = (result: unknown): ToolOutcome | null =>
  typeof result === 'object' && result !== null && 'tool' in result ? (result as ToolOutcome) : null

/** The result of a job that is no tool with a result of its own. */
export function plainResult(result: JobInfo['result'] | undefined): Record<string, unknown> {
  return outcome(result) || !result ? {} : result
}

/** The result of a friction map, or null where it is something else. */
export function asFriction(result: unknown): FrictionResult | null {
  const found = outcome(result)
  return found?.tool === 'friction' ? found : null
}

/** The figures of the load side, or null where it is something else. */
export function asLoadSide(result: unknown): LoadSideResult | null {
  const found = outcome(result)
  return found?.tool === 'load-side' ? found : null
}

/** The figures of a gantry, or null where it is something else. */
export function asGantry(result: unknown): GantryResult | null {
  const found = outcome(result)
  return found?.tool === 'gantry' ? found : null
}

/** The result of a brake test, or null where it is something else. */
export function asBrakeTest(result: unknown): BrakeResult | null {
  const found = outcome(result)
  return found?.tool === 'brake-test' ? found : null
}

/** The record of a safety function, or null where it is something else. */
export function asSafetyCheck(result: unknown): SafetyResult | null {
  const found = outcome(result)
  return found?.tool === 'safety-check' ? found : null
}

/** The checklist of a first power, or null where it is something else. */
export function asFirstPower(result: unknown): FirstPowerResult | null {
  const found = outcome(result)
  return found?.tool === 'first-power' ? found : null
}

/** Vibration over speed, or null where it is something else. */
export function asVibration(result: unknown): VibrationResult | null {
  const found = outcome(result)
  return found?.tool === 'vibration' ? found : null
}

/** A dwell at one frequency, or null where it is something else. */
export function asDwell(result: unknown): DwellResult | null {
  const found = outcome(result)
  return found?.tool === 'dwell' ? found : null
}

/** Slow vibration and its shapers, or null where it is something else. */
export function asShaping(result: unknown): ShapingResult | null {
  const found = outcome(result)
  return found?.tool === 'shaping' ? found : null
}

/** The load of a cycle, or null where it is something else. */
export function asCycle(result: unknown): CycleResult | null {
  const found = outcome(result)
  return found?.tool === 'cycle' ? found : null
}
