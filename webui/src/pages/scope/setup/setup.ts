import type { ScopeChannelInfo, ScopeMath, ScopeSetup, ScopeTrace } from '../../../api/schema'
import { ExpressionError, parse } from '../../../live/scope/analysis/expression'
import type { TriggerSettings } from '../../../live/scope/trigger'
import type { ScopeConfig, ScopeSource, ScopeTrigger } from '../../../live/worker/worker-messages'
import { type Span, sound } from '../../../plots/geometry/yscale'
import { keep, kept } from '../../../widgets/browser/kept'
import { STATUS_WORD, VELOCITY_ACTUAL } from '../../../widgets/parameters/objects'
import type { Channel } from './channels'

export const GREATEST_CHANNELS = 16
export const GREATEST_MATHS = 8
/** Fixed scales that a set-up keeps, also of units that are not shown now. */
const MOST_RANGES = 32
/** Bit of the status word that is set in both fault states (CiA 402-2, table 29); a family may have another. */
const FAULT_BIT = 3
const HIDDEN = 't1'
const STORED = 'servodeck.scope.setup'

export const EMPTY: ScopeSetup = {
  traces: [],
  maths: [],
  trigger: {
    mode: 'off',
    kind: 'rising',
    trace: '',
    drive: '',
    level: 0,
    high: 0,
    bit: 0,
    before: 0.2,
  },
  window_s: 5,
  persistence: 0,
  ranges: [],
}

/** The set-up that this browser used last; null when there is none. */
export function storedSetup(): ScopeSetup | null {
  try {
    const found = JSON.parse(kept(STORED) ?? 'null') as Partial<ScopeSetup> | null
    if (!found || !Array.isArray(found.traces) || !Array.isArray(found.maths)) return null
    return complete(found)
  } catch {
    return null
  }
}

/** A set-up that an earlier version kept, with what it did not know yet. */
const complete = (old: Partial<ScopeSetup>): ScopeSetup => ({
  ...EMPTY,
  ...old,
  trigger: { ...EMPTY.trigger, ...old.trigger },
})

export const storeSetup = (setup: ScopeSetup) => keep(STORED, JSON.stringify(setup))

/** A name that no trace has yet: `c1`, `c2`… for channels, `m1`… for computed ones. */
export function freeId(setup: ScopeSetup, letter: 'c' | 'm'): string {
  const used = new Set([...setup.traces, ...setup.maths].map((each) => each.id))
  let number = 1
  while (used.has(`${letter}${number}`)) number++
  return `${letter}${number}`
}

/** The set-up with these channels; those that were there keep their names and units. */
export function withChannels(setup: ScopeSetup, channels: Channel[]): ScopeSetup {
  const next: ScopeSetup = { ...setup, traces: [] }
  const kept = (channel: Channel) =>
    setup.traces.find((each) => each.drive === channel.drive && each.key === channel.key)
  for (const channel of channels) {
    const old = kept(channel)
    const others = { ...setup, traces: [...setup.traces, ...next.traces] }
    next.traces.push(
      old ?? {
        id: freeId(others, 'c'),
        ...channel,
        show: 'axis',
        factor: 1,
        offset: 0,
        unit: '',
      },
    )
  }
  return next
}

/** A trace as it is shown. */
export interface Shown {
  id: string
  label: string
  unit: string
  /** Null for computed channels and while the server has not said it yet. */
  synchronous: boolean | null
  computed: boolean
}

export type Infos = Map<string, ScopeChannelInfo>

/** What the server said of a channel, whatever subscription brings it. */
export const infoOf = (infos: Infos, drive: string, key: string): ScopeChannelInfo | null =>
  infos.get(`${drive} ${key}`) ?? null

/** Factor, offset and unit in which a channel is shown. */
export function scaleOf(
  trace: Pick<ScopeTrace, 'show' | 'factor' | 'offset' | 'unit'>,
  info: ScopeChannelInfo | null,
): { factor: number; offset: number; unit: string } {
  if (trace.show === 'own') {
    return { factor: trace.factor, offset: trace.offset, unit: trace.unit }
  }
  if (trace.show === 'axis' && info?.axis_factor != null) {
    return { factor: info.axis_factor, offset: 0, unit: info.axis_unit }
  }
  return { factor: 1, offset: 0, unit: info?.unit ?? '' }
}

export function mathProblem(math: ScopeMath): ExpressionError | null {
  try {
    parse(math.expression)
    return null
  } catch (error) {
    return error as ExpressionError
  }
}

/** The channel that a trigger on a fault or on motion looks at, shown or not. */
function hiddenSource(setup: ScopeSetup, infos: Infos): ScopeSource | null {
  const { mode, kind, drive } = setup.trigger
  if (mode === 'off' || !drive || (kind !== 'fault' && kind !== 'motion')) return null
  const key = kind === 'fault' ? STATUS_WORD : VELOCITY_ACTUAL
  const { factor } = scaleOf(
    { show: kind === 'fault' ? 'drive' : 'axis', factor: 1, offset: 0, unit: '' },
    infoOf(infos, drive, key),
  )
  return { id: HIDDEN, drive, key, factor, offset: 0 }
}

export function configOf(setup: ScopeSetup, infos: Infos): ScopeConfig {
  const sources = setup.traces.map((trace) => {
    const { factor, offset } = scaleOf(trace, infoOf(infos, trace.drive, trace.key))
    return { id: trace.id, drive: trace.drive, key: trace.key, factor, offset }
  })
  const hidden = hiddenSource(setup, infos)
  return {
    sources: hidden ? [...sources, hidden] : sources,
    maths: setup.maths.map(({ id, expression }) => ({ id, expression })),
    period: 0,
  }
}

/** The set-up with this y scale for a unit; null lets it follow the traces. */
export function withRange(setup: ScopeSetup, unit: string, span: Span | null): ScopeSetup {
  const others = setup.ranges.filter((each) => each.unit !== unit).slice(1 - MOST_RANGES)
  if (!span) return { ...setup, ranges: others }
  const { min, max } = sound(span)
  return { ...setup, ranges: [...others, { unit, low: min, high: max }] }
}

export const rangesOf = (setup: ScopeSetup): Map<string, Span> =>
  new Map(setup.ranges.map(({ unit, low, high }) => [unit, { min: low, max: high }]))

export const needsDrive = (kind: string) => kind === 'fault' || kind === 'motion'
export const needsLevel = (kind: string) =>
  !['bit_set', 'bit_clear', 'change', 'fault'].includes(kind)
export const needsHigh = (kind: string) => kind === 'enters' || kind === 'leaves'
export const needsBit = (kind: string) => kind === 'bit_set' || kind === 'bit_clear'

/** The set-up without a trigger on an axis that is not there; `drives` is null while not known. */
export function withoutGoneAxis(
  setup: ScopeSetup,
  drives: readonly { id: string }[] | null,
): ScopeSetup {
  const { kind, drive } = setup.trigger
  const gone = drives !== null && needsDrive(kind) && !drives.some((each) => each.id === drive)
  return gone ? { ...setup, trigger: { ...setup.trigger, mode: 'off' } } : setup
}

export function triggerOf(setup: ScopeSetup, infos: Infos): ScopeTrigger | null {
  const { mode, kind, trace, drive, level, high, bit, before } = setup.trigger
  if (mode === 'off') return null
  const settings: TriggerSettings = {
    kind: kind === 'fault' ? 'bit_set' : kind,
    level,
    high,
    bit: kind === 'fault' ? (infoOf(infos, drive, STATUS_WORD)?.fault_bit ?? FAULT_BIT) : bit,
    window: setup.window_s,
    before,
  }
  const known = [...setup.traces, ...setup.maths].map((each) => each.id)
  const id = needsDrive(kind) ? HIDDEN : known.includes(trace) ? trace : known[0]
  return id === undefined ? null : { id, mode, settings, persistence: setup.persistence }
}
