import { beforeAll, describe, expect, it } from 'vitest'
import { problemTitle, sayIn, type T, translate } from './index'
import { fetchProfilesBy, formatted, keepProfile, load, words } from './message'

beforeAll(async () => {
  await load('en')
  await load('zh')
})

describe('a message of the server', () => {
  const rejected = {
    code: 'sdo-abort.write-refused-of',
    params: {
      parameter: '6081:00',
      abort_code: 0x06090030,
      cause: { code: 'sdo-abort.x06090030', params: {} },
    },
  }
  it('is a sentence of the catalogue in either language, with messages inside', () => {
    expect(words('en', rejected)).toBe(
      'the drive refused the write of 6081:00: the drive does not accept this value (abort 06090030h)',
    )
    expect(words('zh', rejected)).toBe('驱动器拒绝写入 6081:00：驱动器不接受该值（中止 06090030h）')
  })
  it('is found under its present name in a file of an earlier version', () => {
    const params = { drive: 'x', detail: 'y' }
    expect(words('en', { code: 'autotune.no-candidate-kept-promise', params })).toBe(
      'x: no design met its prediction in the verification: y',
    )
    expect(words('en', { code: 'autotune.promise-not-kept', params: {} })).toBe(
      'the verification did not confirm its prediction',
    )
  })
  it('has a remedy behind its code', () => {
    expect(words('en', { code: 'canopen.not-open/remedy', params: { drive: 'x' } })).toBe(
      'open the bus first',
    )
    expect(words('zh', { code: 'canopen.not-open/remedy', params: {} })).toBe('请先打开总线')
  })
  it('writes digits without groups, and names in quotes', () => {
    const found = { code: 'modbus.found', params: { count: 12345 } }
    expect(words('en', found)).toBe('12345 found')
    expect(words('en', { code: 'link.no-network-interface', params: { value: 'eth0 x' } })).toBe(
      "'eth0 x' is not a network interface",
    )
  })
  it('is strung together with others as each language does', () => {
    const both = {
      code: '+',
      params: { joint: ': ', part0: { code: 'autotune.title', params: {} }, part1: 'X' },
    }
    expect(words('en', both)).toBe('Tune: X')
    expect(words('zh', both)).toBe('整定：X')
  })
  it('names what a profile names, once its texts are here', () => {
    const fault = {
      code: 'station.fault',
      params: {
        kind: 'fault',
        fault_code: 'x1',
        fault_name: { code: '=', params: { profile: 'mms7', words: 'Over-current' } },
      },
    }
    const wanted: string[] = []
    fetchProfilesBy((profile) => wanted.push(profile))
    expect(words('en', fault)).toContain('Over-current')
    expect(wanted).toEqual([])
    expect(words('zh', fault)).toContain('Over-current')
    expect(wanted).toEqual(['mms7'])
    keepProfile('mms7', new Map([['Over-current', '过电流']]))
    expect(words('zh', fault)).toContain('过电流')
    expect(words('zh', fault)).not.toContain('Over-current')
  })
  it('is what others said where it has no code, and what the server said where it is not known', () => {
    expect(words('zh', { code: '', params: { words: 'errno 5' } })).toBe('errno 5')
    expect(words('zh', { code: 'canopen.of-another-version', params: {} }, 'as said')).toBe(
      'as said',
    )
    expect(words('zh', { code: 'nothing.known', params: { a: 1 } })).toBe('nothing.known (a=1)')
  })
  it('makes the note of a problem', () => {
    const problem = {
      type: 'urn:servodeck:link-lost',
      title: '',
      status: 503,
      detail: 'as said',
      remedy: 'do it',
      code: 'canopen.not-open',
      params: { drive: 'canopen://x' },
      advice: { code: 'canopen.not-open/remedy', params: {} },
    }
    expect(sayIn('zh').detail(problem)).toBe('canopen://x 未打开')
    expect(sayIn('zh').remedy(problem)).toBe('请先打开总线')
    expect(sayIn('en').detail({ ...problem, code: null, params: { words: 'x' } })).toBe('as said')
  })
})

describe('the title of a problem', () => {
  const zh: T = (key, variables) => translate('zh', key, variables)
  const problem = (type: string) => ({ type, title: 'In use', status: 409, detail: '' })
  it('is that of its type, and never the English one of the server', () => {
    expect(problemTitle(zh, problem('urn:servodeck:busy'))).toBe('正在使用')
    expect(problemTitle(zh, problem('urn:servodeck:not-granted'))).toBe('需要运动许可')
    for (const type of ['urn:servodeck:of-another-version', 'about:blank', '']) {
      expect(problemTitle(zh, problem(type))).toBe('操作未成功。')
    }
  })
})

describe('a number', () => {
  // What Python 3 prints for format(value, spec).
  it.each([
    [1234.56, '.1f', '1234.6'],
    [0.25, '.0%', '25%'],
    [0x603f, '04X', '603F'],
    [0x130, '#06x', '0x0130'],
    [10, 'g', '10'],
    [0.0001234, 'g', '0.0001234'],
    [0.00001234, 'g', '1.234e-05'],
    [1234567, 'g', '1.23457e+06'],
    [1500, '.2g', '1.5e+03'],
    [12.3456, '.3g', '12.3'],
    [5, '02d', '05'],
    [2.5, '', '2.5'],
    [16.27, '+.1f', '+16.3'],
    [-16.27, '+.1f', '-16.3'],
  ] as const)('%d in the format %s is %s', (value, format, text) => {
    expect(formatted(value, format)).toBe(text)
  })
})
