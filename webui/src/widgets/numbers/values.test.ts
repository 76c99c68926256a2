import { describe, expect, it } from 'vitest'
import type { ParameterRow } from '../../api/schema'
import { parseStations } from '../../pages/connect/scan/stations'
import { groups, isChanged, matches, select } from '../../pages/parameters/filters'
import { clock, dateTime, duration, figure, hexadecimal, quantity, shown, toValue } from './format'
import { bitFields, getField, parseTyped, setField } from './parse'
import { translatedRows } from '../profile-text/shown-row'

function row(part: Partial<ParameterRow>): ParameterRow {
  const reading = {
    key: '2005:03',
    raw: null,
    value: null,
    time: null,
    error: '',
    unused: false,
    unsaved: false,
    pending: '',
  }
  return {
    key: '2005:03',
    number: null,
    name: 'Speed loop bandwidth',
    group: 'Gains',
    type: 'UINT16',
    access: 'rw',
    pdo: 'none',
    unit: 'Hz',
    scale: 0.1,
    offset: 0,
    min_raw: 10,
    max_raw: 5000,
    default_raw: 300,
    enum: {},
    bits: {},
    effective: 'now',
    settable: 'any',
    motor_individual: false,
    motion: 'none',
    safe_in_motion: false,
    motion_page: '',
    motion_how: '',
    help: '',
    source: '004:1',
    also_printed: [],
    notes: '',
    reachable: true,
    unreachable_why: '',
    ...part,
    reading: part.reading ?? reading,
  }
}

describe('typed values', () => {
  it('turns engineering values into raw ones', () => {
    expect(parseTyped(row({}), '12.3', false)).toEqual({ ok: true, raw: 123 })
    expect(parseTyped(row({}), '12,3', false)).toEqual({ ok: true, raw: 123 })
    expect(parseTyped(row({}), '123', true)).toEqual({ ok: true, raw: 123 })
    expect(parseTyped(row({}), '0x7B', false)).toEqual({ ok: true, raw: 123 })
    expect(parseTyped(row({ offset: 5 }), '17.3', false)).toEqual({ ok: true, raw: 123 })
  })
  it('names the limit in the unit', () => {
    expect(parseTyped(row({}), '0.5', false)).toEqual({ ok: false, why: 'low', limit: '1 Hz' })
    expect(parseTyped(row({}), '501', false)).toEqual({ ok: false, why: 'high', limit: '500 Hz' })
  })
  it('refuses what is no number', () => {
    for (const text of ['', 'abc', '1.2.3', '12 Hz', '0x', 'NaN', 'Infinity', 'False']) {
      expect(parseTyped(row({}), text, false)).toEqual({ ok: false, why: 'number' })
    }
    expect(parseTyped(row({}), '12.5', true)).toEqual({ ok: false, why: 'whole' })
  })
  it('takes an enum as its raw value', () => {
    const info = row({ scale: 0.1, enum: { '10': 'ten', '20': 'twenty' } })
    expect(parseTyped(info, '20', false)).toEqual({ ok: true, raw: 20 })
  })
  it('leaves text as it is', () => {
    const info = row({ type: 'STRING', min_raw: null, max_raw: null })
    expect(parseTyped(info, ' a,b ', false)).toEqual({ ok: true, raw: ' a,b ' })
  })
})

describe('bit fields', () => {
  const info = row({ bits: { '3': 'enable', '6-4': 'mode', '15': 'sign' }, type: 'INT16' })
  it('are found from low to high', () => {
    expect(bitFields(info)).toEqual([
      { low: 3, width: 1, label: 'enable' },
      { low: 4, width: 3, label: 'mode' },
      { low: 15, width: 1, label: 'sign' },
    ])
  })
  it('are read and set without touching their neighbours', () => {
    const mode = { low: 4, width: 3, label: 'mode' }
    expect(getField(0x58, mode)).toBe(5)
    expect(setField(0x58, mode, 2, 'UINT16')).toBe(0x28)
  })
  it('keep the sign of a signed type, and work beyond 31 bits', () => {
    const top = { low: 15, width: 1, label: 'sign' }
    expect(getField(-32768, top)).toBe(1)
    expect(setField(0, top, 1, 'INT16')).toBe(-32768)
    expect(setField(0, { low: 31, width: 1, label: '' }, 1, 'UINT32')).toBe(2147483648)
  })
})

describe('figures', () => {
  it('show two’s complement in the width of the type', () => {
    expect(hexadecimal(-1, 'INT16')).toBe('0xFFFF')
    expect(hexadecimal(10, 'UINT32')).toBe('0x0000000A')
  })
  it('keep units of 0.1 exact', () => {
    expect(toValue(row({}), 3)).toBe(0.3)
  })
  it('name the enum value', () => {
    expect(shown(row({ enum: { '1': 'on' } }), 1, 1)).toBe('1 · on')
    expect(shown(row({}), null, null)).toBe('—')
  })
  it('do not dance, and write times and sizes as people do', () => {
    expect(quantity(1.23456, 'rpm')).toBe('1.2')
    expect(quantity(-0.5, 'rev')).toBe('−0.5000')
    expect(quantity(null, 'V')).toBe('—')
    expect(quantity(-0.04, 'rpm')).toBe('0.0')
    expect(duration(59.4)).toBe('59 s')
    expect(duration(185)).toBe('3:05')
    expect(duration(3723)).toBe('1:02:03')
    expect(figure(1234567)).toBe('1234600')
  })
})

describe('filters', () => {
  const rows = [
    row({ key: '2005:03', number: 'P08.02' }),
    row({ key: '6064:00', name: 'Position actual value', group: 'Motion', access: 'ro' }),
    row({ key: '2001:01', name: 'Stop mode', settable: 'stopped' }),
  ]
  const marks = {
    edited: new Set(['2005:03']),
    differs: new Set<string>(),
    favourites: new Set(['6064:00']),
    readings: new Map([
      ['2005:03', { ...rows[0]!.reading, raw: 301, value: 30.1 }],
      ['2001:01', { ...rows[2]!.reading, raw: 300, value: 30, unsaved: true }],
    ]),
  }
  const keys = (filter: Parameters<typeof select>[1]['filter'], search = '') =>
    select(rows, { filter, group: null, search }, marks).map((each) => each.key)
  it('find by name, number and key, with or without colon, 0x and h', () => {
    expect(keys('all', 'bandwidth speed')).toEqual(['2005:03'])
    expect(keys('all', 'p08.02')).toEqual(['2005:03'])
    for (const text of ['6064', '0x6064', '6064h', '606400', '6064:00']) {
      expect(keys('all', text)).toEqual(['6064:00'])
    }
    expect(matches(rows[0]!, 'speed torque')).toBe(false)
  })
  it('show edited, unsaved, changed, favourite and set-at-stop apart', () => {
    expect(keys('edited')).toEqual(['2005:03'])
    expect(keys('unsaved')).toEqual(['2001:01'])
    expect(keys('changed')).toEqual(['2005:03'])
    expect(keys('favourites')).toEqual(['6064:00'])
    expect(keys('stopped')).toEqual(['2001:01'])
    expect(keys('differs')).toEqual([])
    expect(keys('unread')).toEqual(['2005:03', '6064:00', '2001:01'])
  })
  it('do not call a value changed that was never read', () => {
    expect(isChanged(rows[0]!, undefined)).toBe(false)
  })
  it('count groups', () => {
    expect(groups(rows)).toEqual([
      { name: 'Gains', label: 'Gains', count: 2 },
      { name: 'Motion', label: 'Motion', count: 1 },
    ])
  })
  it('know a group by its English name, whatever it is called on the page', () => {
    const chinese = translatedRows(rows, new Map([['Gains', '增益']]))
    expect(groups(chinese)[0]).toEqual({ name: 'Gains', label: '增益', count: 2 })
    const wanted = { filter: 'all' as const, group: 'Gains', search: '' }
    expect(select(chinese, wanted, marks).map((each) => each.key)).toHaveLength(2)
  })
  it('leave reserved parameters out until somebody looks for them', () => {
    const reserved = row({ key: '2001:1F', name: "Reserved (Don't set)" })
    const all = [...rows, reserved]
    const chosen = (search: string) =>
      select(all, { filter: 'all', group: null, search }, marks).map((each) => each.key)
    expect(chosen('')).not.toContain('2001:1F')
    expect(chosen('2001:1F')).toEqual(['2001:1F'])
    expect(chosen('reserved')).toEqual(['2001:1F'])
  })
  it('find a translated parameter in both languages', () => {
    const said = new Map([[rows[0]!.name, '速度环比例增益']])
    const [first] = translatedRows(rows, said)
    expect(matches(first!, '速度环')).toBe(true)
    expect(matches(first!, rows[0]!.name)).toBe(true)
    expect(matches(first!, '位置环')).toBe(false)
  })
})

describe('stations', () => {
  it('are numbers and ranges', () => {
    expect(parseStations('1-3, 9')).toEqual([1, 2, 3, 9])
    for (const bad of ['a', '3-1', '1-', '70000', '1-65535']) expect(parseStations(bad)).toBeNull()
  })
})

describe('times', () => {
  it('read the same in every country, and midnight is 00', () => {
    const at = new Date(2026, 2, 4, 0, 5, 9).toISOString()
    expect(clock(at)).toBe('00:05:09')
    expect(dateTime(at)).toBe('2026-03-04 00:05:09')
    expect(dateTime(null)).toBe('—')
  })
})
