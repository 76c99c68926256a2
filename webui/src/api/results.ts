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

/** The result of this tool, or null where it is something else. */
export function resultOf<K extends ToolOutcome['tool']>(
  tool: K,
  result: unknown,
): Extract<ToolOutcome, { tool: K }> | null {
  const found = outcome(result)
  return found?.tool === tool ? (found as Extract<ToolOutcome, { tool: K }>) : null
}
