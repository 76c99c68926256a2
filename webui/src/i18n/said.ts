import { catalogue, type Key } from './catalogue'
import type { T } from './index'

/** The server's sentences as patterns, the longest first: `Read {axis} anew` before `Read {axis}`. */
const PATTERNS = under('said')
  .sort(([, one], [, other]) => other.length - one.length)
  .map(([key, english]) => ({ key, pattern: patternOf(english) }))

/** Every key that begins with a prefix, and its English text. */
function under(prefix: string): [Key, string][] {
  return Object.entries(catalogue)
    .filter(([key]) => key.startsWith(`${prefix}.`))
    .map(([key, [english]]) => [key as Key, english])
}

/** What is put in ends where the next sentence begins. */
function patternOf(english: string): RegExp {
  const quoted = english.replace(/[.*+?^$()|[\]\\]/g, '\\$&')
  return new RegExp(`^${quoted.replace(/\{(\w+)\}/g, '(?<$1>(?:(?!: |; ).)+?)')}$`, 'u')
}

/** How the server strings sentences together, and how Chinese does; the outermost first. */
const JOINTS = [
  ['\n', '\n'],
  ['; ', '；'],
  [': ', '：'],
] as const

/**
 * What the server says, in the language of the page. Lines, and parts between semicolons and
 * colons, are sentences of their own; what is not known, such as the name of an axis, passes as it
 * is.
 */
export function said(t: T, text: string): string {
  for (const { key, pattern } of PATTERNS) {
    const found = pattern.exec(text)
    if (found) return t(key, { ...found.groups })
  }
  for (const [joint, chinese] of JOINTS) {
    const at = text.indexOf(joint)
    if (at < 0) continue
    const first = said(t, text.slice(0, at))
    const rest = said(t, text.slice(at + joint.length))
    return first + (/\p{Script=Han}/u.test(first) ? chinese : joint) + rest
  }
  return text
}
