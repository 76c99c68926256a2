import type { BrakeResult, FrictionResult, HealthResult, InertiaAnswer, JobInfo } from './schema'

/** What a tool concluded: distinguished by its field `tool`. */
type ToolOutcome = BrakeResult | FrictionResult | HealthResult | InertiaAnswer

const outcome = (result: unknown): ToolOutcome | null =>
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

/** The result of a brake test, or null where it is something else. */
export function asBrakeTest(result: unknown): BrakeResult | null {
  const found = outcome(result)
  return found?.tool === 'brake-test' ? found : null
}
