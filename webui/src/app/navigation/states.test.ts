import { describe, expect, it } from 'vitest'
import type { AxisState, Quality } from '../../api/schema'
import { listsFaults, linkLook, stateSign } from './states'

const quality = (part: Partial<Quality>): Quality => ({
  connected: true,
  state: 'open',
  transactions: 10_000,
  timeouts: 0,
  crc_errors: 0,
  framing_errors: 0,
  retries: 0,
  lost_frames: 0,
  wkc_errors: 0,
  round_trip_ms: 1,
  details: {},
  ...part,
})

describe('link quality in a word', () => {
  it('follows the share of exchanges that went wrong', () => {
    expect(linkLook(null).word).toBe('none')
    expect(linkLook(quality({ connected: false })).word).toBe('lost')
    expect(linkLook(quality({ timeouts: 10 })).word).toBe('good')
    expect(linkLook(quality({ timeouts: 11 })).word).toBe('fair')
    expect(linkLook(quality({ crc_errors: 201 })).word).toBe('poor')
  })
  it('counts the frames of a cyclic exchange', () => {
    const cyclic = quality({
      transactions: 30,
      lost_frames: 8,
      details: { cyclic_cycles: 100_000 },
    })
    expect(linkLook(cyclic).word).toBe('good')
  })
})

describe('the sign of a state in the 3D scene', () => {
  // As `look_of` of the server: torque, none, a fault, not known.
  it.each([
    ['Not ready to switch on', 'O'],
    ['Switch on disabled', 'O'],
    ['Ready to switch on', 'O'],
    ['Switched on', 'O'],
    ['Operation enabled', 'I'],
    ['Quick stop active', 'I'],
    ['Fault reaction active', '!'],
    ['Fault', '!'],
    ['Unknown', '?'],
  ])('of %s is %s', (state, sign) => {
    expect(stateSign({ state, fresh: true } as AxisState)).toBe(sign)
    expect(stateSign({ state, fresh: false } as AxisState)).toBe('?')
  })
})

describe('a fault', () => {
  it('is reported above every page that does not list it itself, also when it was there before', () => {
    for (const page of ['response', 'tune', 'motion', 'gains', 'parameters'] as const) {
      expect(listsFaults(page, true)).toBe(false)
    }
    expect(listsFaults('alarms', false)).toBe(true)
    expect(listsFaults('overview', true)).toBe(true)
    expect(listsFaults('overview', false)).toBe(false)
  })
})
