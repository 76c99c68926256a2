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

function patternOf(english: string): RegExp {
  const quoted = english.replace(/[.*+?^$()|[\]\\]/g, '\\$&')
  return new RegExp(`^${quoted.replace(/\{(\w+)\}/g, '(?<$1>.+?)')}$`, 'u')
}

/**
 * What the server says of a job, in the language of the page. Parts between colons are sentences
 * of their own; what is not known, such as the name of an axis, passes as it is.
 */
export function said(t: T, text: string): string {
  for (const { key, pattern } of PATTERNS) {
    const found = pattern.exec(text)
    if (found) return t(key, { ...found.groups })
  }
  const colon = text.indexOf(': ')
  if (colon < 0) return text
  const first = said(t, text.slice(0, colon))
  return first + (/\p{Script=Han}/u.test(first) ? '：' : ': ') + said(t, text.slice(colon + 2))
}
