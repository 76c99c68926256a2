import { describe, expect, it } from 'vitest'
import type { ScopeChannelInfo, ScopeSetup } from '../../../api/schema'
import {
  configOf,
  EMPTY,
  type Infos,
  scaleOf,
  triggerOf,
  withChannels,
  withoutGoneAxis,
} from './setup'

const info = (key: string, more: Partial<ScopeChannelInfo> = {}): [string, ScopeChannelInfo] => [
  `x ${key}`,
  {
    drive: 'x',
    key,
    name: key,
    unit: 'inc/s',
    synchronous: true,
    axis_unit: 'rpm',
    axis_factor: 0.01,
    fault_bit: null,
    ...more,
  },
]
const armed = (trigger: Partial<ScopeSetup['trigger']>): ScopeSetup => ({
  ...withChannels(EMPTY, [{ drive: 'x', key: '6064:00' }]),
  trigger: { ...EMPTY.trigger, mode: 'single', drive: 'x', ...trigger },
})
const none: Infos = new Map()

describe('a trigger on a fault', () => {
  it('samples the status word as the drive gives it, shown or not', () => {
    const { sources } = configOf(armed({ kind: 'fault' }), new Map([info('6041:00')]))
    expect(sources.map((each) => each.key)).toEqual(['6064:00', '6041:00'])
    expect(sources[1]).toMatchObject({ drive: 'x', factor: 1, offset: 0 })
    expect(triggerOf(armed({ kind: 'fault' }), none)?.id).toBe(sources[1]?.id)
  })
  it('looks at bit 3, or at the bit that the family has for it', () => {
    const bit = (infos: Infos) => triggerOf(armed({ kind: 'fault' }), infos)?.settings
    expect(bit(none)).toMatchObject({ kind: 'bit_set', bit: 3 })
    expect(bit(new Map([info('6041:00', { fault_bit: 7 })]))).toMatchObject({ bit: 7 })
  })
  it('samples nothing more while no trigger is wanted', () => {
    const off = armed({ kind: 'fault', mode: 'off' })
    expect(configOf(off, none).sources).toHaveLength(1)
    expect(triggerOf(off, none)).toBeNull()
  })
})

describe('a trigger on motion', () => {
  it('looks at the speed in the unit of the axis, in which its level is typed', () => {
    const setup = armed({ kind: 'motion', level: 20 })
    const { sources } = configOf(setup, new Map([info('606C:00')]))
    expect(sources[1]).toMatchObject({ key: '606C:00', factor: 0.01 })
    expect(triggerOf(setup, none)?.settings).toMatchObject({ kind: 'motion', level: 20 })
  })
})

describe('any other trigger', () => {
  it('looks at the chosen trace, at the first one where that is gone, and at none where none is', () => {
    expect(triggerOf(armed({ kind: 'enters', trace: 'c1' }), none)?.id).toBe('c1')
    expect(triggerOf(armed({ kind: 'change', trace: 'c9' }), none)?.id).toBe('c1')
    expect(triggerOf({ ...armed({ kind: 'change' }), traces: [] }, none)).toBeNull()
  })
})

describe('a channel', () => {
  it('is shown in the unit of the axis, of the drive, or in one of its own', () => {
    const [, known] = info('606C:00')
    const own = { factor: 2, offset: 1, unit: 'l/min' }
    expect(scaleOf({ show: 'axis', ...own }, known)).toEqual({
      factor: 0.01,
      offset: 0,
      unit: 'rpm',
    })
    expect(scaleOf({ show: 'drive', ...own }, known)).toEqual({
      factor: 1,
      offset: 0,
      unit: 'inc/s',
    })
    expect(scaleOf({ show: 'own', ...own }, known)).toEqual(own)
    expect(scaleOf({ show: 'axis', ...own }, { ...known, axis_factor: null }).unit).toBe('inc/s')
  })
})

describe('a trigger on an axis that is gone', () => {
  it('seeks nothing, and samples nothing for it', () => {
    for (const kind of ['fault', 'motion'] as const) {
      const setup = armed({ kind })
      const left = withoutGoneAxis(setup, [{ id: 'y' }])
      expect(triggerOf(left, none)).toBeNull()
      expect(configOf(left, none).sources).toHaveLength(1)
      expect(withoutGoneAxis(setup, [{ id: 'x' }])).toBe(setup)
      // Not known yet.
      expect(withoutGoneAxis(setup, null)).toBe(setup)
    }
    const rising = armed({ kind: 'rising', trace: 'c1', drive: 'gone' })
    expect(withoutGoneAxis(rising, [])).toBe(rising)
  })
})
