import { readFileSync } from 'node:fs'
import { describe, expect, it } from 'vitest'

const css = readFileSync(new URL('./style.css', import.meta.url), 'utf-8')

/** Variables of the first rule with this selector. */
function palette(selector: string): Map<string, string> {
  const begin = css.indexOf(`${selector} {`)
  const rule = css.slice(begin, css.indexOf('}', begin))
  return new Map([...rule.matchAll(/--([\w-]+):\s*(#[0-9a-f]{6});/g)].map((m) => [m[1]!, m[2]!]))
}

/** WCAG 2.2, relative luminance of an sRGB colour. */
function luminance(color: string): number {
  const [r = 0, g = 0, b = 0] = [1, 3, 5].map((at) => {
    const part = Number.parseInt(color.slice(at, at + 2), 16) / 255
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4
  })
  return 0.2126 * r + 0.7152 * g + 0.0722 * b
}

/** WCAG 2.2, contrast ratio. */
function contrast(a: string, b: string): number {
  const [low = 0, high = 0] = [luminance(a), luminance(b)].toSorted((x, y) => x - y)
  return (high + 0.05) / (low + 0.05)
}

const TONES = ['live', 'warn', 'fault', 'ready', 'off', 'edited', 'unsaved', 'differs']
const PAIRS: [string, string][] = [
  ...['text', 'dim', 'accent', 'live', 'warn', 'fault'].flatMap((name): [string, string][] => [
    [name, 'ground'],
    [name, 'panel'],
  ]),
  ...TONES.map((name): [string, string] => [name, `${name}-soft`]),
  ...TONES.filter((name) => !['edited', 'unsaved', 'differs'].includes(name)).map(
    (name): [string, string] => ['text', `${name}-soft`],
  ),
  ['text', 'accent-soft'],
  ['dim', 'accent-soft'],
]

describe.each([
  ['light', ':root'],
  ['dark', ":root[data-mantine-color-scheme='dark']"],
])('the %s scheme', (_name, selector) => {
  const colors = palette(selector)
  it.each(PAIRS)('shows %s on %s with a contrast of 4.5 or more', (front, back) => {
    expect(contrast(colors.get(front)!, colors.get(back)!)).toBeGreaterThanOrEqual(4.5)
  })
  it('shows STOP with a contrast of 4.5 or more', () => {
    expect(contrast('#ffffff', colors.get('stop')!)).toBeGreaterThanOrEqual(4.5)
  })
})

describe('contrast', () => {
  it('agrees with the standard: black on white is 21', () => {
    expect(contrast('#000000', '#ffffff')).toBeCloseTo(21, 5)
  })
})
