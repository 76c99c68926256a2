import type { FromPage, JogStart, JogStop, ToPage } from '../../api/schema'
import type { Columns } from '../scope/decimate'
import type { Measurement } from '../scope/analysis/measure'
import type { LinkState } from './socket'
import type { Spectrogram, Spectrum, WindowKind } from '../scope/analysis/spectrum'
import type { TriggerSettings } from '../scope/trigger'

/** A channel to be sampled, shown as (drive's value × factor + offset). */
export interface ScopeSource {
  id: string
  drive: string
  key: string
  factor: number
  offset: number
}

/** All that is sampled and computed; replaces the earlier one and keeps what is in both. */
export interface ScopeConfig {
  sources: ScopeSource[]
  maths: { id: string; expression: string }[]
  period: number
}

export interface ScopeTrigger {
  id: string
  mode: 'auto' | 'normal' | 'single'
  settings: TriggerSettings
  /** Earlier sweeps that stay in sight. */
  persistence: number
}

/** Whether a trigger is sought, and whether anything was caught since it was armed. */
export type TriggerState = 'off' | 'waiting' | 'triggered'

export interface ScopeView {
  ids: string[]
  /** Fixed stretch, or the newest `window` seconds, or the newest triggered stretch. */
  show: { from: number; to: number } | { window: number } | { trigger: 'newest' }
  bins: number
  /** Figures over this stretch, over what is shown, or none. */
  measure: { from: number; to: number } | 'shown' | null
  cursors: number[]
  persistence: boolean
}

/** One earlier sweep of one trace, its times counted from its trigger. */
export interface Overlay {
  trace: number
  times: number[]
  values: number[]
}

/** What the view lost; raw data on the server are not concerned. */
export interface Losses {
  /** Samples that the server had to leave out. */
  dropped: number
  /** Blocks that never arrived. */
  blocks: number
  /** Synchronous samples that passed while there was no connection. */
  away: number
}

export interface ScopeFrame {
  columns: Columns
  from: number
  to: number
  newest: number | null
  trigger: { state: 'off' | 'waiting' | 'triggered' | 'auto'; at: number | null; count: number }
  overlays: Overlay[]
  measurements: (Measurement | null)[] | null
  cursorValues: (number | null)[][]
  losses: Losses
  /** Rows a second per trace. */
  rates: (number | null)[]
  /** Seconds by which the newest sample of a trace lies behind the newest of all. */
  ages: (number | null)[]
  /** Seconds since anything of a trace arrived here. */
  silent: (number | null)[]
}

/** Raw samples of one trace. */
export interface Samples {
  times: Float64Array
  values: Float64Array
}

interface Stretch {
  from: number
  to: number
}

/** What the page asks the worker, and what it gets. */
export interface Questions {
  view: { ask: ScopeView; get: ScopeFrame }
  csv: { ask: Stretch & { ids: string[]; names: string[]; origin: number }; get: string }
  samples: { ask: Stretch & { ids: string[] }; get: Samples[] }
  spectrum: {
    ask: Stretch & { id: string; window: WindowKind; synchronous: boolean }
    get: Spectrum | null
  }
  spectrogram: {
    ask: Stretch & { id: string; columns: number; synchronous: boolean }
    get: Spectrogram | null
  }
  xy: {
    ask: Stretch & { x: string; y: string; most: number }
    /** Points of the curve, and when each of them was. */
    get: { x: number[]; y: number[]; times: number[] }
  }
}
export type QuestionKind = keyof Questions

export type ToWorker =
  | { kind: 'open'; url: string }
  | { kind: 'send'; message: FromPage }
  | { kind: 'stand'; name: string; message: FromPage | null }
  | { kind: 'jogStart'; message: JogStart }
  | { kind: 'jogBeat'; drive: string }
  | { kind: 'jogStop'; reason: JogStop['reason'] }
  | { kind: 'enablePress'; invitation: string }
  | { kind: 'enableBeat' }
  | { kind: 'enableRelease'; reason: JogStop['reason'] }
  | { kind: 'scope'; config: ScopeConfig }
  | { kind: 'scopeClear' }
  | { kind: 'trigger'; trigger: ScopeTrigger | null }
  | {
      [Kind in QuestionKind]: { kind: 'ask'; id: number; what: Kind; ask: Questions[Kind]['ask'] }
    }[QuestionKind]

export type FromWorker =
  | { kind: 'link'; state: LinkState }
  | { kind: 'message'; message: ToPage }
  | { kind: 'jogRefused' }
  /** Is the button still held? Answered with `jogBeat`. */
  | { kind: 'jogAsked' }
  /** The enabling button counts as released, though nobody may have let it go. */
  | { kind: 'enableEnded' }
  | { kind: 'subscriptions'; numbers: number[] }
  | { kind: 'triggered'; state: TriggerState }
  | { kind: 'answer'; id: number; answer: Questions[QuestionKind]['get'] }
