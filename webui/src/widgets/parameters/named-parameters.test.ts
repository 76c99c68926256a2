import { expect, test } from 'vitest'
import { namedParameters } from './named-parameters'

const row = (key: string, number: string | null = null) => ({ key, number, name: key })
const ROWS = [row('2042:03'), row('608F:01'), row('608F:02'), row('200A:0E', 'P10.13'), row('PA_2')]

const named = (text: string) =>
  namedParameters(text, ROWS).map((part) =>
    part.row ? `<${part.text}=${part.row.key}>` : part.text,
  )

test('what a remedy names leads to the parameter, by any of its numbers', () => {
  expect(named('The time 2042:03 may be too short')).toEqual([
    'The time ',
    '<2042:03=2042:03>',
    ' may be too short',
  ])
  expect(named('Check 608Fh, P10.13 and PA_2.')).toEqual([
    'Check ',
    '<608Fh=608F:01>',
    ', ',
    '<P10.13=200A:0E>',
    ' and ',
    '<PA_2=PA_2>',
    '.',
  ])
})

test('what the drive does not have, and what is no parameter, stays text', () => {
  for (const text of ['Set P99.01', 'Check CN2 and the 24 V at X1', 'Turn by hand', 'ABCD']) {
    expect(named(text)).toEqual([text])
  }
})
