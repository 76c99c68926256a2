import type { Sweep } from '../results'

/** What a measured response of the mechanics lets one say about the machine. */
interface Judgement {
  /** Load class by the first antiresonance; see docs/tuning.md. Null where there is none. */
  load: 'stiff' | 'medium' | 'compliant' | null
  /** Inertia behind the first soft part against what is before it: (f_r/f_a)² − 1. */
  ratio: number | null
  hints: Hint[]
}

/** Something to look at on the machine before any filter is set. */
type Hint = 'noise' | 'saturated' | 'moved' | 'wide' | 'low' | 'many' | 'untrusted'

const COMPLIANT_HZ = 80
const MEDIUM_HZ = 300
const LEAST_COHERENCE = 0.9
/** A good measurement finds a resonance within 1 %; the mechanics changed beyond this. */
const MOVED = 0.04
const WIDE_DAMPING = 0.08

const first = (sweep: Sweep, kind: 'resonance' | 'antiresonance') =>
  sweep.resonances.find((each) => each.kind === kind) ?? null

/** The nearest resonance of another measurement has another frequency. */
function moved(sweep: Sweep, other: Sweep | null): boolean {
  if (!other || other.kind !== 'mechanics') return false
  const then = other.resonances.filter((each) => each.kind === 'resonance')
  if (then.length === 0) return false
  return sweep.resonances
    .filter((each) => each.kind === 'resonance')
    .some((each) =>
      then.every((old) => Math.abs(Math.log(old.frequency_hz / each.frequency_hz)) > MOVED),
    )
}

/** Read a response as an engineer would; `other` is an earlier one of the same axis. */
export function judge(sweep: Sweep, other: Sweep | null): Judgement {
  const valley = first(sweep, 'antiresonance')
  const peak = sweep.resonances.find(
    (each) => each.kind === 'resonance' && each.frequency_hz > (valley?.frequency_hz ?? 0),
  )
  const peaks = sweep.resonances.filter((each) => each.kind === 'resonance')
  const [low, high] = sweep.valid_band_hz
  const inside = sweep.coherence.filter((_, i) => {
    const f = sweep.frequency_hz[i] ?? 0
    return f >= low && f <= high
  })
  const middle = inside.toSorted((a, b) => a - b)[Math.floor(inside.length / 2)] ?? 1
  const hints: Hint[] = []
  if (!sweep.trusted) hints.push('untrusted')
  if (middle < LEAST_COHERENCE) hints.push('noise')
  if (sweep.saturated_share > 0.02) hints.push('saturated')
  if (moved(sweep, other)) hints.push('moved')
  if (peaks.some((each) => each.damping > WIDE_DAMPING)) hints.push('wide')
  if (valley && valley.frequency_hz < COMPLIANT_HZ) hints.push('low')
  if (peaks.length >= 3) hints.push('many')
  return {
    load: !sweep.trusted
      ? null
      : !valley
        ? 'stiff'
        : valley.frequency_hz < COMPLIANT_HZ
          ? 'compliant'
          : valley.frequency_hz < MEDIUM_HZ
            ? 'medium'
            : 'stiff',
    ratio: valley && peak ? (peak.frequency_hz / valley.frequency_hz) ** 2 - 1 : null,
    hints,
  }
}

/** Curve shapes that are explained with a sketch: points of a line in a box of 100 × 60. */
export const SHAPES = [
  { name: 'rigid', line: 'M4 6 L96 54' },
  {
    name: 'coupling',
    line: 'M4 10 L52 32 C56 35 57 50 59 50 C61 50 62 12 66 12 C69 12 71 36 96 50',
  },
  { name: 'belt', line: 'M4 10 L22 20 C26 23 27 44 29 44 C31 44 33 14 38 14 C43 14 46 32 96 54' },
  {
    name: 'several',
    line: 'M4 8 L28 20 C31 22 32 38 33 38 C35 38 36 12 39 12 C42 12 43 28 56 34 C58 36 59 48 60 48 C62 48 63 22 66 22 C69 22 71 42 96 54',
  },
  {
    name: 'backlash',
    line: 'M4 12 L24 20 30 17 34 27 40 22 44 34 49 26 53 39 58 30 64 42 70 34 78 46 86 42 96 54',
  },
  { name: 'friction', line: 'M4 24 C20 24 30 25 40 30 L96 54' },
] as const
