import type { AxisState, Quality } from '../../api/schema'
import type { IconName } from '../../widgets/layout/Icon'
import type { Page } from './router'

/** How an axis state looks: a colour class and an icon; the words are always next to them. */
export function stateLook(state: AxisState | null): { tone: string; icon: IconName } {
  if (!state?.fresh) return { tone: 'old', icon: 'question' }
  switch (state.state) {
    case 'Operation enabled':
      return { tone: 'live', icon: 'bolt' }
    case 'Fault':
    case 'Fault reaction active':
      return { tone: 'fault', icon: 'alarms' }
    case 'Quick stop active':
      return { tone: 'warn', icon: 'hold' }
    case 'Switched on':
    case 'Ready to switch on':
      return { tone: 'ready', icon: 'check' }
    default:
      return { tone: 'off', icon: 'hold' }
  }
}

/**
 * The sign of a state in the 3D scene, as `look_of` in backend/scene/feed.py gives it: I where the
 * motor has torque, O where it has none, ! with a fault, ? where the state is not known.
 */
export function stateSign(state: AxisState | null): 'I' | 'O' | '!' | '?' {
  if (!state?.fresh || state.state === 'Unknown') return '?'
  switch (state.state) {
    case 'Operation enabled':
    case 'Quick stop active':
      return 'I'
    case 'Fault':
    case 'Fault reaction active':
      return '!'
    default:
      return 'O'
  }
}

/** Counters that mean trouble on a link. */
function troubles(quality: Quality): number {
  return (
    quality.timeouts +
    quality.crc_errors +
    quality.framing_errors +
    quality.lost_frames +
    quality.wkc_errors
  )
}

/** Link quality in one word: share of exchanges that went wrong since the link was opened. */
export function linkLook(quality: Quality | null): {
  word: 'none' | 'lost' | 'good' | 'fair' | 'poor'
  tone: string
} {
  if (!quality) return { word: 'none', tone: 'old' }
  if (!quality.connected) return { word: 'lost', tone: 'fault' }
  // Frames of a cyclic exchange count too, and outnumber everything else where there is one.
  const cycles = Number(quality.details.cyclic_cycles ?? 0) || 0
  const share = troubles(quality) / Math.max(1, quality.transactions + cycles)
  if (share > 0.02) return { word: 'poor', tone: 'fault' }
  if (share > 0.001) return { word: 'fair', tone: 'warn' }
  return { word: 'good', tone: 'live' }
}

/**
 * Whether a page has the faults first on it itself; `reported`: there were some when it was opened.
 */
export const listsFaults = (page: Page, reported: boolean): boolean =>
  page === 'alarms' || (page === 'overview' && reported)
