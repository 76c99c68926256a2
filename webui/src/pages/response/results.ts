/** Results of tuning jobs, as the server's tools write them (backend/tools). */

import type {
  AgainInfo,
  AutotuneAnswer,
  BandInfo,
  CandidateInfo,
  InertiaAnswer,
  IntervalInfo,
  NotchInfo,
  ResonanceInfo,
  StepAnswer,
  SweepAnswer,
  VerdictInfo,
} from '../../api/schema'

export type Resonance = Partial<ResonanceInfo> &
  Omit<ResonanceInfo, 'frequency_ci95_hz' | 'damping_ci95'>

export type Margins = Record<string, number | boolean | null>

/** A response. Files of older versions lack some fields; recordings of other programs have more. */
export type Sweep = Pick<
  SweepAnswer,
  | 'kind'
  | 'loop'
  | 'sample_rate_hz'
  | 'valid_band_hz'
  | 'frequency_hz'
  | 'magnitude_db'
  | 'phase_deg'
  | 'coherence'
  | 'std_db'
  | 'std_deg'
  | 'margins'
  | 'unit'
  | 'trusted'
  | 'motion_s'
  | 'saturated_share'
  | 'warnings'
> &
  Partial<Pick<SweepAnswer, 'warning_messages' | 'periods_used' | 'load'>> & {
    resonances: Resonance[]
    imported?: ImportedFacts
    axis?: ImportedAxis | null
  }

/** How a recording of another program was evaluated (backend/records/response_import/evaluation.py). */
export interface ImportedFacts {
  excitation: 'periodic' | 'chirp' | 'noise'
  method: string
  period_s: number | null
  transient_periods: number
  structure: string
}

/** What was concluded where the structure was stated; figures only where the verdict is sound. */
export interface ImportedAxis {
  verdict: 'sound' | 'not-collocated' | 'no-rigid-part'
  inertia?: number
  inertia_ci95?: [number, number]
  inertia_unit?: string
  viscous?: number
  viscous_unit?: string
  candidates?: Candidate[]
}

/** Measurements of older servers lack some fields. */
export type Inertia = Omit<InertiaAnswer, 'tool' | 'measurements' | 'place_periods_rev'>

export type NotchShape = NotchInfo

export type Candidate = CandidateInfo

export type Step = Omit<StepAnswer, 'measurements'>

export type Again = AgainInfo
export type Interval = IntervalInfo
export type BandVerdict = BandInfo
export type Verdict = VerdictInfo

/** Jobs of older servers lack some fields. */
export type Autotune = Omit<AutotuneAnswer, 'tool' | 'measurements'>

const has = (value: unknown, ...names: string[]): boolean =>
  typeof value === 'object' && value !== null && names.every((name) => name in value)

/** The result of a frequency response, or null where it is something else. */
export const asSweep = (value: unknown): Sweep | null =>
  has(value, 'frequency_hz', 'magnitude_db', 'coherence', 'valid_band_hz') ? (value as Sweep) : null

export const asInertia = (value: unknown): Inertia | null =>
  has(value, 'inertia_kgm2', 'ci95', 'verdict') ? (value as Inertia) : null

export const asAutotune = (value: unknown): Autotune | null =>
  has(value, 'mechanics', 'candidates', 'before') ? (value as Autotune) : null

/** Files that a job stored, newest last. */
export function filesOf(result: unknown): string[] {
  const files = (result as { measurements?: unknown } | null)?.measurements
  return Array.isArray(files) ? files.filter((file) => typeof file === 'string') : []
}
