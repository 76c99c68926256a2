import { useCallback, useEffect, useSyncExternalStore } from 'react'
import { api, ask } from '../../api/client'
import { textsCame, useLanguage } from '../../i18n'
import { fetchProfilesBy, keepProfile } from '../../i18n/message'
import { useDrive, useDrives, useLink } from '../../live/store'
import { keep, kept } from '../browser/kept'

/** English text of a profile to its translation; null until the server has said it. */
export type Texts = ReadonlyMap<string, string> | null

const loaded = new Map<string, Texts>()
const asked = new Set<string>()
const listeners = new Set<() => void>()

const ORIGINAL = 'servodeck.original'
let original = kept(ORIGINAL) === 'yes'

function changed(): void {
  for (const listener of listeners) listener()
}

function subscribe(listener: () => void): () => void {
  listeners.add(listener)
  return () => listeners.delete(listener)
}

/** Once for each profile; asked again by the next reader when the server did not answer. */
function load(profile: string): void {
  if (asked.has(profile)) return
  asked.add(profile)
  ask(
    api.GET('/api/v1/profiles/{profile}/texts', {
      params: { path: { profile }, query: { language: 'zh' } },
    }),
  ).then(
    (found) => {
      const texts = new Map(Object.entries(found.texts))
      loaded.set(profile, texts)
      keepProfile(profile, texts)
      changed()
      textsCame()
    },
    () => asked.delete(profile),
  )
}

// A message in the log may be of a drive that is not on the page.
fetchProfilesBy(load)

/** The translated texts of a drive's profile; null in English and until they are known. */
export function useTexts(drive: string): Texts {
  const language = useLanguage()
  const { open } = useLink()
  const profile = useDrive(drive)?.profile ?? null
  const wanted = language === 'zh' ? profile : null
  useEffect(() => {
    if (wanted !== null && open) load(wanted)
  }, [wanted, open])
  const texts = useSyncExternalStore(subscribe, () =>
    profile === null ? null : (loaded.get(profile) ?? null),
  )
  return wanted === null ? null : texts
}

/** Says a profile's text in the page's language, for where an element cannot stand. */
export function useSay(drive: string): (text: string) => string {
  const texts = useTexts(drive)
  return (text) => texts?.get(text) ?? text
}

/** Whether the English original is next to each translated text. */
export function useOriginal(): boolean {
  return useSyncExternalStore(subscribe, () => original)
}

export function setOriginal(shown: boolean): void {
  original = shown
  keep(ORIGINAL, shown ? 'yes' : 'no')
  changed()
}

/** As `useSay`, for texts of several drives at once; another function once more texts are known. */
export function useSayOf(): (drive: string, text: string) => string {
  const language = useLanguage()
  const { open } = useLink()
  const drives = useDrives()
  const chinese = language === 'zh'
  const wanted = [...new Set(chinese ? drives?.map((drive) => drive.profile) : [])].sort().join(' ')
  useEffect(() => {
    if (open) for (const profile of wanted.split(' ').filter(Boolean)) load(profile)
  }, [wanted, open])
  const known = useSyncExternalStore(subscribe, () =>
    wanted
      .split(' ')
      .filter((profile) => loaded.has(profile))
      .join(' '),
  )
  return useCallback(
    (drive, text) => {
      const profile = drives?.find((each) => each.id === drive)?.profile ?? ''
      return (known.split(' ').includes(profile) ? loaded.get(profile)?.get(text) : null) ?? text
    },
    [drives, known],
  )
}
