import { describe, expect, it } from 'vitest'
import type { AxisRecordInfo, AxisState, GainBlock, TerminalInfo } from '../api/schema'
import { grouped } from '../pages/gains/blocks'
import { probeSettings } from '../pages/io/probe'
import { polarityName, twins } from '../pages/io/terminals'
import { travelOf } from '../pages/overview/travel'
import { brakeCourse } from '../pages/setup/brake'
import { complete, formOf, START, toMechanics } from '../pages/setup/mechanics'

function terminal(name: string, function_name: string, functions: [number, string][]) {
  return {
    name,
    function_name,
    functions: functions.map(([code, text]) => ({ code, name: text, help: '' })),
  } as TerminalInfo
}

describe('terminals', () => {
  const one = terminal('DI1', 'touch probe 1', [
    [0, 'not used'],
    [3, 'home switch'],
    [4, 'touch probe 1'],
  ])
  const two = terminal('DI2', 'home switch', [
    [0, 'not used'],
    [3, 'home switch'],
    [4, 'touch probe 2'],
  ])
  it('warns of a function that another terminal has, by name', () => {
    expect(twins([one, two], one, 3)).toEqual(['DI2'])
    // The same code means another function at the other terminal.
    expect(twins([one, two], two, 4)).toEqual([])
  })
  it('lets any number of terminals have no function', () => {
    const free = terminal('DI3', 'not used', [[0, 'not used']])
    expect(twins([one, two, free], one, 0)).toEqual([])
  })
  it('takes the words for a polarity from the label of its bit', () => {
    const label = 'DI1 normally open (0: normally closed)'
    expect(polarityName(label, 1)).toBe('normally open')
    expect(polarityName(label, 0)).toBe('normally closed')
    expect(polarityName('DI1 negative logic', 1)).toBeNull()
    expect(polarityName('DI1 常开（0：常闭）', 1)).toBe('常开')
    expect(polarityName('DI1 常开（0：常闭）', 0)).toBe('常闭')
  })
})

describe('touch probes', () => {
  it('reads the bits of each probe', () => {
    // Manual 004:4670: 0013h is probe 1 on, continuous, rising.
    expect(probeSettings(0x13, 1)).toEqual({
      on: true,
      continuous: true,
      source: 0,
      rising: true,
      falling: false,
    })
    expect(probeSettings(0x2500, 2)).toMatchObject({ on: true, source: 1, falling: true })
    // One maker prints the object as signed.
    expect(probeSettings(-32768 + 0x100, 2).on).toBe(true)
  })
})

describe('gain blocks', () => {
  const blocks: GainBlock[] = [
    { block: 'speed', set_number: 2, keys: ['2'], help: '', source: '' },
    { block: 'position', set_number: 1, keys: ['0'], help: '', source: '' },
    { block: 'speed', set_number: 1, keys: ['1'], help: '', source: '' },
    { block: 'current', set_number: null, keys: ['9'], help: '', source: '' },
  ]
  it('orders sets and leaves out what cannot be reached', () => {
    const found = grouped(blocks, new Set(['0', '1', '2']))
    expect(found.map((each) => each.block)).toEqual(['position', 'speed'])
    expect(found[1]?.parts.map((part) => part.set_number)).toEqual([1, 2])
  })
})

describe('mechanics', () => {
  it('needs the dimensions of its kind only', () => {
    expect(complete(START)).toBe(false)
    expect(complete({ ...START, lead_mm: 5 })).toBe(true)
    expect(complete({ ...START, kind: 'rotary' })).toBe(true)
    expect(complete({ ...START, kind: 'rack', rack: 'module', module_mm: 2 })).toBe(false)
  })
  it('sends no leftovers of another kind', () => {
    const sent = toMechanics({
      ...START,
      kind: 'belt',
      belt: 'diameter',
      lead_mm: 5,
      diameter_mm: 9,
    })
    expect(sent.lead_mm).toBeNull()
    expect(sent.diameter_mm).toBe(9)
  })
  it('comes back as it was kept', () => {
    const form = { ...START, kind: 'belt' as const, belt: 'teeth' as const, pitch_mm: 5, teeth: 20 }
    expect(formOf(toMechanics(form))).toEqual(form)
  })
})

describe('brake course', () => {
  const times = { openDelay: 20, commandDelay: 250, closeDelay: 100, closeSpeed: 10, hold: 150 }
  it('opens before commands and loses power after it closed', () => {
    const of = (name: string) => brakeCourse(times).traces.find((each) => each.name === name)
    const edges = (name: string) => of(name)?.points.map(([ms]) => ms) ?? []
    const [servo, output, command, power] = ['servo', 'output', 'command', 'power'].map(edges)
    expect((output?.[1] ?? 0) - (servo?.[1] ?? 0)).toBe(20)
    expect((command?.[1] ?? 0) - (output?.[1] ?? 0)).toBe(250)
    expect((power?.[3] ?? 0) - (output?.[3] ?? 0)).toBe(150)
  })
  it('writes only times that the drive has', () => {
    const none = {
      openDelay: null,
      commandDelay: null,
      closeDelay: null,
      closeSpeed: null,
      hold: 5,
    }
    expect(brakeCourse(none).spans.map((span) => span.text)).toEqual(['5 ms'])
  })
})

describe('travel', () => {
  const record = { travel_unit: 'mm', travel_per_motor_turn: 10 } as AxisRecordInfo
  const state = {
    position: -1.5,
    velocity: 60,
    units: { position: 'rev', velocity: 'rpm' },
  } as unknown as AxisState
  it('follows from the mechanics', () => {
    expect(travelOf(record, state)).toEqual([
      { name: 'position', value: '−15.000', unit: 'mm' },
      { name: 'velocity', value: '10.00', unit: 'mm/s' },
    ])
  })
  it('is not shown where it would be a guess', () => {
    expect(travelOf({ ...record, travel_per_motor_turn: null }, state)).toEqual([])
    const raw = { ...state, units: { position: 'inc', velocity: 'inc/s' } } as unknown as AxisState
    expect(travelOf(record, raw)).toEqual([])
  })
})
