/** Results of tuning jobs, as the server's tools write them (backend/tools). */

import type { InertiaAnswer, MessageInfo } from '../../api/schema'

export interface Resonance {
  kind: 'resonance' | 'antiresonance'
  frequency_hz: number
  damping: number
  height_db: number
  /** Where the true value lies in 95 of 100 cases; older measurements do not say. */
  frequency_ci95_hz?: [number, number] | null
  damping_ci95?: [number, number] | null
}

export type Margins = Record<string, number | boolean | null>

export interface Sweep {
  kind: 'mechanics' | 'speed_loop' | 'position_loop'
  loop: string
  sample_rate_hz: number
  valid_band_hz: [number, number]
  frequency_hz: number[]
  magnitude_db: number[]
  phase_deg: number[]
  coherence: number[]
  std_db: (number | null)[]
  std_deg: (number | null)[]
  resonances: Resonance[]
  margins: Margins
  unit: string
  trusted: boolean
  motion_s: number
  saturated_share: number
  warnings: string[]
  /** Of warnings, as code and facts; files of older versions have the sentences alone. */
  warning_messages?: MessageInfo[]
  periods_used?: number
  /** Of recordings of other programs only. */
  imported?: ImportedFacts
  axis?: ImportedAxis | null
}

/** How a recording of another program was evaluated (backend/response_import/evaluation.py). */
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

export interface NotchShape {
  center_hz: number
  width_hz: number
  depth_db: number
}

export interface Candidate {
  notches: NotchShape[]
  gains: {
    speed_nms: number
    integral_hz: number
    position_1_s: number
    speed_bandwidth_hz: number
  }
  bandwidth_hz: number | null
  position_bandwidth_hz: number | null
  nominal: {
    phase_margin_deg: number | null
    gain_margin_db: number | null
    ms: number
    stable: boolean
  }
  promised: { gain_margin_db: number; phase_margin_deg: number; ms: number }
  phase_cost_deg: number
  overshoot_percent: number
  settling_s: number | null
  marks: string[]
}

export interface Step {
  kind: 'speed' | 'move'
  unit: string
  time_s: number[]
  demand: number[]
  actual: number[]
  torque_percent: number[]
  /** Settling window; absent in jobs of an older server. */
  window?: number | null
  /** Whether noise asked for a wider window than 2 % of the step. */
  widened?: boolean
  step: {
    overshoot_percent: number
    rise_s: number | null
    settling_s: number | null
  } | null
  move: {
    following_peak: number
    following_rms: number
    overshoot: number
    settling_s: number | null
  } | null
  torque_peak_percent: number
  torque_rms_percent: number
}

/** A loop that answered otherwise than predicted, and the prediction that was made from it. */
export interface Again {
  predicted: LoopFigures
  measured: LoopFigures
  outcome: string
  gain_ratio: number | null
  /** The closed loop that was predicted for the second verification; null without one. */
  frequency_hz: number[] | null
  closed_db: number[] | null
  closed_deg: number[] | null
}

interface LoopFigures {
  bandwidth_hz: number | null
  phase_margin_deg: number | null
  gain_margin_db: number | null
}

/** A value with the ends of its 95 % interval. */
export interface Interval {
  value: number
  low: number
  high: number
}

/** Margins over one band; null where nothing crosses there. */
export interface BandVerdict {
  low_hz: number
  high_hz: number
  phase_margin_deg: Interval | null
  gain_margin_db: Interval | null
  peak_sensitivity: Interval | null
}

/** What is known of a tuned loop: measured over a band, predicted beyond it. */
export interface Verdict {
  measured: BandVerdict | null
  predicted: BandVerdict | null
  last_crossover_hz: number
  coverage: 'measured' | 'gain_steps' | 'predicted'
  shown_gain_db: number | null
}

export interface Autotune {
  inertia: Inertia
  mechanics: Sweep
  load: string
  candidates: Candidate[]
  applied: Candidate | null
  verified: {
    sweep: Sweep
    predicted_bandwidth_hz: number | null
    measured_bandwidth_hz: number | null
    /** Absent in jobs of an older server. */
    verdict?: Verdict | null
  } | null
  /** What was made of a loop that answered otherwise than predicted; absent or null without. */
  again?: Again | null
  step: Step | null
  before: Record<string, number>
  /** Raw values of what was applied; absent in jobs of an older server. */
  after?: Record<string, number>
  tried: string[]
  tried_messages?: MessageInfo[]
  /** Absent in jobs of an older server. */
  notes?: string[]
  note_messages?: MessageInfo[]
  measurements?: string[]
}

const has = (value: unknown, ...names: string[]): boolean =>
  typeof value === 'object' && value !== null && names.every((name) => name in value)

/** The result of a frequency response, or null where it is something else. */
export const asSweep = (value: unknown): Sweep | null =>
  has(value, 'frequency_hz', 'magnitude_db', 'coherence', 'valid_band_hz') ? (value as Sweep) : null

export const asInertia = (value: unknown): Inertia | null =>
  has(value, 'inertia_kgm2', 'ci95', 'verdict') ? (value as Inertia) : null

export const asStep = (value: unknown): Step | null =>
  has(value, 'time_s', 'demand', 'actual') ? (value as Step) : null

export const asAutotune = (value: unknown): Autotune | null =>
  has(value, 'mechanics', 'candidates', 'before') ? (value as Autotune) : null

export const asCandidates = (value: unknown[]): Candidate[] =>
  value.filter((each) => has(each, 'gains', 'notches', 'marks')) as Candidate[]

/** Files that a job stored, newest last. */
export function filesOf(result: unknown): string[] {
  const files = (result as { measurements?: unknown } | null)?.measurements
  return Array.isArray(files) ? files.filter((file) => typeof file === 'string') : []
}
