// @vitest-environment happy-dom
import { serve } from '../testing/page'
import { describe, expect, it } from 'vitest'
import type { ParameterRow } from './schema'
import { hexadecimal, shown, toValue } from '../widgets/numbers/format'
import { parseTyped } from '../widgets/numbers/parse'
import { api, ask } from './client'
import { exactJson } from './exact'

const BIG = '9007199254740993' // 2^53 + 1, which a number of this language does not hold
const row = (part: Partial<ParameterRow>) =>
  ({
    key: '2003:41', type: 'INT64', unit: '', scale: 1, offset: 0, enum: {}, bits: {},
    min_raw: -(2 ** 63), max_raw: 2 ** 63, ...part,
  }) as ParameterRow // prettier-ignore

describe('whole numbers beyond 2^53', () => {
  it('arrive as their digits, and all others as numbers', () => {
    const text = `{"raw":${BIG},"value": -${BIG} ,"default_raw":12,"t_ns":${BIG},"max_raw":${BIG},
      "note":"\\"raw\\":${BIG},","before":{"2003:41":${BIG},"2003:42":7},"file_value":1.5e17}`
    expect(JSON.parse(exactJson(text))).toEqual({
      raw: BIG,
      value: `-${BIG}`,
      default_raw: 12,
      t_ns: Number(BIG),
      max_raw: Number(BIG),
      note: `"raw":${BIG},`,
      before: { '2003:41': BIG, '2003:42': 7 },
      file_value: 1.5e17,
    })
  })

  it('come so through the client', async () => {
    const headers = { 'Content-Type': 'application/json' }
    serve(() => new Response(`[{"key":"2003:41","raw":${BIG},"value":${BIG}}]`, { headers }))
    const path = { drive_id: 'x' }
    const rows = await ask(api.GET('/api/v1/drives/{drive_id}/parameters', { params: { path } }))
    expect(rows).toEqual([{ key: '2003:41', raw: BIG, value: BIG }])
  })

  it('are shown digit by digit', () => {
    expect(shown(row({}), BIG, BIG)).toBe(BIG)
    expect(shown(row({}), `-${BIG}`, `-${BIG}`)).toBe(`−${BIG}`)
    expect(hexadecimal(BIG, 'INT64')).toBe('0x0020000000000001')
    expect(hexadecimal('-1', 'INT64')).toBe('0xFFFFFFFFFFFFFFFF')
    expect(hexadecimal('18446744073709551615', 'UINT64')).toBe('0xFFFFFFFFFFFFFFFF')
    expect(toValue(row({}), BIG)).toBe(BIG)
    expect(toValue(row({ scale: 0.5 }), '9007199254740994')).toBe(4503599627370000)
  })

  it('are written as they were typed, or refused', () => {
    const typed = (text: string, part: Partial<ParameterRow> = {}, asRaw = false) =>
      parseTyped(row(part), text, asRaw)
    expect(typed(BIG)).toEqual({ ok: true, raw: BIG })
    expect(typed(`-${BIG}`)).toEqual({ ok: true, raw: `-${BIG}` })
    expect(typed('0x20000000000001')).toEqual({ ok: true, raw: BIG })
    expect(typed('9223372036854775807')).toEqual({ ok: true, raw: '9223372036854775807' })
    expect(typed('9223372036854775808')).toEqual({ ok: false, why: 'long' })
    expect(typed('12')).toEqual({ ok: true, raw: 12 })
    const positive = { type: 'UINT64', min_raw: 0, max_raw: 2 ** 64 }
    expect(typed('18446744073709551615', positive)).toEqual({
      ok: true,
      raw: '18446744073709551615',
    })
    expect(typed(`-${BIG}`, positive)).toEqual({ ok: false, why: 'long' })
    expect(typed(BIG, { max_raw: 1000 })).toEqual({ ok: false, why: 'high', limit: '1000' })
    expect(typed(BIG, { scale: 0.1 }, true)).toEqual({ ok: true, raw: BIG })
  })
})
