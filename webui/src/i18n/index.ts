import { useSyncExternalStore } from 'react'
import type { JobInfo, Problem } from '../api/schema'
import { keep, kept } from '../widgets/browser/kept'
import { catalogue, type Key } from './catalogue'
import { load, words, type Message } from './message'

export type Language = 'en' | 'zh'
export type { Key }

const STORED = 'servodeck.language'
const listeners = new Set<() => void>()
let language: Language = initial()
/** How often texts have come: a component that shows messages is drawn again then. */
let generation = 0

function initial(): Language {
  const stored = kept(STORED)
  if (stored === 'en' || stored === 'zh') return stored
  return globalThis.navigator?.language.startsWith('zh') ? 'zh' : 'en'
}

fetchTexts()

/** Messages are shown in the server's words until their own are here. */
function fetchTexts(): void {
  load(language).then(textsCame, () => undefined) // offline: the server's words stay
}

/** Draw everything that shows messages again. */
export function textsCame(): void {
  generation += 1
  for (const listener of listeners) listener()
}

// Screen readers and hyphenation go by this; index.html cannot know the stored language.
if (globalThis.document) mark(language)

function mark(to: Language): void {
  document.documentElement.lang = to === 'zh' ? 'zh-Hans' : 'en'
}

export function setLanguage(next: Language): void {
  language = next
  keep(STORED, next)
  mark(next)
  fetchTexts()
  for (const listener of listeners) listener()
}

/**
 * Text of a key; `{name}` is replaced by the variable of that name, and `{name|one|more}` by the
 * first word where it is 1 and by the second otherwise.
 */
export function translate(
  to: Language,
  key: Key,
  variables: Record<string, string | number> = {},
): string {
  const text: string = catalogue[key][to === 'en' ? 0 : 1]
  return text.replace(
    /\{(\w+)(?:\|([^|}]*)\|([^}]*))?\}/g,
    (whole: string, name: string, one?: string, more?: string) => {
      if (!(name in variables)) return whole
      if (one === undefined) return String(variables[name])
      return (Number(variables[name]) === 1 ? one : more) ?? ''
    },
  )
}

export type T = (key: Key, variables?: Record<string, string | number>) => string

export function useLanguage(): Language {
  return useSyncExternalStore(
    (listener) => {
      listeners.add(listener)
      return () => listeners.delete(listener)
    },
    () => language,
  )
}

/** The translating function; the component re-renders when the language changes. */
export function useT(): T {
  const to = useLanguage()
  return (key, variables) => translate(to, key, variables)
}

/** Text the server sends in a closed English vocabulary, such as states; unknown text passes. */
export function known(t: T, prefix: string, text: string): string {
  const key = `${prefix}.${text}`
  return key in catalogue ? t(key as Key) : text
}

const PROBLEM = 'urn:servodeck:'

/** What kind of problem it is, by its type; the server's own title is English for everybody. */
export function problemTitle(t: T, problem: Problem): string {
  const kind = problem.type.startsWith(PROBLEM) ? problem.type.slice(PROBLEM.length) : ''
  const title = known(t, 'problemTitle', kind)
  return title === kind ? t('problem.title') : title
}

function useTexts(): Language {
  useSyncExternalStore(
    (listener) => {
      listeners.add(listener)
      return () => listeners.delete(listener)
    },
    () => generation,
  )
  return useLanguage()
}

/** What the server says by code and facts, in the language of the page. */
export interface Say {
  /** The words of a message; `otherwise` where there is none, as in files of older versions. */
  message: (message: Message | null | undefined, otherwise?: string) => string
  /** The words of several; of files of older versions, which have no messages, the sentences. */
  messages: (messages: Message[] | null | undefined, otherwise?: string[]) => string[]
  detail: (problem: Problem) => string
  remedy: (problem: Problem) => string
  title: (job: JobInfo) => string
  step: (job: JobInfo) => string
}

/** Sentences from codes; the component is drawn again when language or texts change. */
export function useSay(): Say {
  const to = useTexts()
  return sayIn(to)
}

export function sayIn(to: Language): Say {
  return {
    message: (message, otherwise) => (message ? words(to, message, otherwise) : (otherwise ?? '')),
    messages: (messages, otherwise) =>
      messages ? messages.map((each) => words(to, each)) : (otherwise ?? []),
    detail: (problem) =>
      problem.code
        ? words(to, { code: problem.code, params: problem.params ?? {} }, problem.detail)
        : problem.detail,
    remedy: (problem) =>
      problem.advice?.code
        ? words(to, problem.advice, problem.remedy ?? '')
        : (problem.remedy ?? ''),
    title: (job) => words(to, job.title_message, job.title),
    step: (job) => words(to, job.step_message, job.step),
  }
}
