import { useSyncExternalStore } from 'react'
import { catalogue, type Key } from './catalogue'

export type Language = 'en' | 'zh'
export type { Key }

const STORED = 'servodeck.language'
const listeners = new Set<() => void>()
let language: Language = initial()

function initial(): Language {
  const stored = globalThis.localStorage?.getItem(STORED)
  if (stored === 'en' || stored === 'zh') return stored
  return globalThis.navigator?.language.startsWith('zh') ? 'zh' : 'en'
}

// Screen readers and hyphenation go by this; index.html cannot know the stored language.
if (globalThis.document) mark(language)

function mark(to: Language): void {
  document.documentElement.lang = to === 'zh' ? 'zh-Hans' : 'en'
}

export function setLanguage(next: Language): void {
  language = next
  globalThis.localStorage?.setItem(STORED, next)
  mark(next)
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
