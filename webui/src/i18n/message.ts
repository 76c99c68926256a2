import {
  FluentBundle,
  FluentNumber,
  FluentResource,
  FluentType,
  type FluentValue,
  type FluentVariable,
} from '@fluent/bundle'
import type { MessageInfo } from '../api/schema'

/** A message without words: a code of `texts/catalogue`, and its facts. */
export type Message = MessageInfo
type Fact = NonNullable<Message['params']>[string]
type Spoken = 'en' | 'zh'

/** Codes of what is not in the catalogue: words of others, and messages one after the other. */
const PROSE = ''
const JOINED = '+'
/** A name or help of a drive family's profile, by its English original. */
const OF_PROFILE = '='
const CHINESE_JOINTS: Record<string, string> = { '; ': '；', ': ': '：', ', ': '、', ' ': '' }

/** Codes of files that earlier versions wrote; the server has the same list (`message.py`). */
const RENAMED: Record<string, string> = {
  'autotune.no-candidate-kept-promise': 'autotune.no-candidate-verified',
  'autotune.promise-not-kept': 'autotune.prediction-not-confirmed',
  'api-tuning.frequency-response': 'sweep.title',
  'api-tuning.tune': 'autotune.title',
}

/** The translated texts of profiles, and how those that a message needs are fetched. */
const ofProfiles = new Map<string, ReadonlyMap<string, string>>()
let fetchProfile: (profile: string) => void = () => undefined

export function fetchProfilesBy(fetch: (profile: string) => void): void {
  fetchProfile = fetch
}

export function keepProfile(profile: string, texts: ReadonlyMap<string, string>): void {
  ofProfiles.set(profile, texts)
}

/** The server's own files, so that page, server and command line say the same. */
const FILES: Record<Spoken, () => Promise<{ sources: Record<string, string> }>> = {
  en: () => import('./sources-en'),
  zh: () => import('./sources-zh'),
}
const sources: Partial<Record<Spoken, Record<string, string>>> = {}
const bundles = new Map<string, FluentBundle>()

/** Fetch the texts of a language; until they are here, messages have the server's words. */
export async function load(language: Spoken): Promise<void> {
  sources[language] ??= (await FILES[language]()).sources
}

/** A number as Python writes it: without groups of digits. */
class Plain extends FluentType<number> {
  override toString(): string {
    return String(this.value)
  }
}

/** A number in a format of Python's `format`, as far as the catalogue uses it. */
export function formatted(value: number, format: string): string {
  if (format.startsWith('+')) {
    const text = formatted(value, format.slice(1))
    return text.startsWith('-') ? text : `+${text}`
  }
  const parts = /^(#?)(0?)(\d*)(?:\.(\d+))?([dfgeXx%]?)$/.exec(format)
  if (!parts) return String(value)
  const [, prefix = '', zero = '', width = '', digits, kind = ''] = parts
  let text: string
  if (kind === 'x' || kind === 'X') {
    const hex = Math.trunc(value).toString(16)
    const fill = Math.max(0, Number(width) - (prefix ? 2 : 0))
    text =
      (prefix && '0x') + (kind === 'X' ? hex.toUpperCase() : hex).padStart(zero ? fill : 0, '0')
    return text
  }
  if (kind === '%') text = `${(value * 100).toFixed(Number(digits ?? 6))}%`
  else if (kind === 'f') text = value.toFixed(Number(digits ?? 6))
  else if (kind === 'e') text = exponent(value.toExponential(Number(digits ?? 6)))
  else if (kind === 'g') text = general(value, Number(digits ?? 6) || 1)
  else text = digits === undefined ? String(value) : general(value, Number(digits))
  return width ? text.padStart(Number(width), zero || ' ') : text
}

/** Python's "g": significant digits, without zeros at the end. */
function general(value: number, digits: number): string {
  if (value === 0) return '0'
  const [mantissa = '', power = '0'] = value.toExponential(digits - 1).split('e')
  const size = Number(power)
  if (size < -4 || size >= digits) return exponent(`${trimmed(mantissa)}e${power}`)
  return trimmed(value.toFixed(Math.max(0, digits - 1 - size)))
}

const trimmed = (text: string): string => (text.includes('.') ? text.replace(/\.?0+$/, '') : text)

/** At least two digits of the exponent, as in Python. */
const exponent = (text: string): string =>
  text.replace(/e([+-])(\d)$/, (_whole, sign: string, digit: string) => `e${sign}0${digit}`)

function num([value]: FluentValue[], options: Record<string, FluentValue>): FluentValue {
  if (typeof value === 'string' || value === undefined) return value ?? ''
  const number = Number(value.valueOf())
  return Number.isNaN(number)
    ? String(value.valueOf())
    : formatted(number, String(options.format ?? ''))
}

function quoted([value]: FluentValue[]): FluentValue {
  return typeof value === 'string'
    ? `'${value}'`
    : value === undefined
      ? ''
      : String(value.valueOf())
}

function bundle(room: string, language: Spoken): FluentBundle | undefined {
  const key = `${language} ${room}`
  const known = bundles.get(key)
  if (known) return known
  const source = sources[language]?.[room]
  if (source === undefined) return undefined
  const made = new FluentBundle(language === 'zh' ? 'zh-Hans' : 'en', {
    functions: { NUM: num, QUOTED: quoted },
    useIsolating: false,
  })
  made.addResource(new FluentResource(source))
  bundles.set(key, made)
  return made
}

/**
 * The sentence in a language. Until the catalogue is loaded, and for a code that it lacks,
 * `otherwise`: what the server said, or the code with its facts.
 */
export function words(language: Spoken, message: Message, otherwise?: string): string {
  const facts = message.params ?? {}
  if (message.code === PROSE) return fact(language, facts.words ?? null)
  if (message.code === OF_PROFILE) {
    const original = fact(language, facts.words ?? null)
    return language === 'en' ? original : ofProfile(fact(language, facts.profile ?? null), original)
  }
  if (message.code === JOINED) {
    const joint = typeof facts.joint === 'string' ? facts.joint : '; '
    return Object.entries(facts)
      .filter(([name]) => name !== 'joint')
      .map(([, part]) => fact(language, part))
      .join(language === 'zh' ? (CHINESE_JOINTS[joint] ?? joint) : joint)
  }
  return pattern(language, message) ?? otherwise ?? bare(language, message)
}

/** English until the texts of the profile are here: they are fetched then. */
function ofProfile(profile: string, original: string): string {
  const texts = ofProfiles.get(profile)
  if (!texts) fetchProfile(profile)
  return texts?.get(original) ?? original
}

function pattern(language: Spoken, message: Message): string | undefined {
  const [stored = '', attribute] = message.code.split('/')
  const code = RENAMED[stored] ?? stored
  const own = bundle(code.split('.')[0] ?? '', language)
  const entry = own?.getMessage(code.replaceAll('.', '_'))
  const found = attribute === undefined ? entry?.value : entry?.attributes[attribute]
  if (!own || !found) return undefined
  const facts = Object.entries(message.params ?? {}).map(
    ([name, value]): [string, FluentVariable] => [
      name,
      typeof value === 'number'
        ? Number.isInteger(value)
          ? new FluentNumber(value, { useGrouping: false })
          : new Plain(value)
        : fact(language, value),
    ],
  )
  const problems: Error[] = []
  return own.formatPattern(found, Object.fromEntries(facts), problems)
}

function fact(language: Spoken, value: Fact): string {
  if (value === null) return ''
  return typeof value === 'object' ? words(language, value) : String(value)
}

function bare(language: Spoken, message: Message): string {
  const facts = Object.entries(message.params ?? {}).map(([k, v]) => `${k}=${fact(language, v)}`)
  return facts.length > 0 ? `${message.code} (${facts.join(', ')})` : message.code
}
