import type { JogStart, ScopeStart } from '../api/schema'
import type { Columns } from './decimate'
import type { Measurement } from './measure'
import type { FromPage, ToPage } from './protocol'
import type { LinkState } from './socket'
import type { TriggerSettings } from './trigger'

/** A trace of the scope: a channel of a subscription. */
export interface TraceRef {
  subscription: number
  channel: number
}

export interface ScopeView {
  traces: TraceRef[]
  /** Fixed stretch, or the newest `window` seconds, or the newest triggered stretch. */
  show: { from: number; to: number } | { window: number } | { trigger: 'newest' }
  bins: number
  measure: { from: number; to: number } | null
  cursors: number[]
}

export interface ScopeFrame {
  columns: Columns
  from: number
  to: number
  newest: number | null
  triggeredAt: number | null
  measurements: (Measurement | null)[]
  cursorValues: (number | null)[][]
  dropped: number
  lostBlocks: number
  /** Rows a second and age of the newest row, per trace; ages in seconds behind the newest. */
  rates: (number | null)[]
  ages: (number | null)[]
}

export type ToWorker =
  | { kind: 'open'; url: string }
  | { kind: 'send'; message: FromPage }
  | { kind: 'stand'; name: string; message: FromPage | null }
  | { kind: 'jogStart'; message: JogStart }
  | { kind: 'jogBeat'; drive: string }
  | { kind: 'jogStop'; reason: string }
  | { kind: 'scopeStart'; message: ScopeStart }
  | { kind: 'scopeStop'; subscription: number }
  | { kind: 'scopeClear' }
  | { kind: 'trigger'; trace: TraceRef | null; settings: TriggerSettings | null }
  | { kind: 'view'; id: number; view: ScopeView }
  | { kind: 'csv'; id: number; traces: TraceRef[]; names: string[]; from: number; to: number }

export type FromWorker =
  | { kind: 'link'; state: LinkState }
  | { kind: 'message'; message: ToPage }
  | { kind: 'jogRefused' }
  | { kind: 'frame'; id: number; frame: ScopeFrame }
  | { kind: 'csv'; id: number; text: string }
