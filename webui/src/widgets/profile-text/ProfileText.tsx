import type { ReactNode } from 'react'
import { useLanguage, useT } from '../../i18n'
import { setOriginal, useOriginal, useTexts } from './texts'
import './profile-text.css'

/**
 * A text of a drive's profile in the page's language. The original is its tooltip, and stands
 * next to it on demand; what has no translation stays English with a small mark.
 */
export function ProfileText({
  drive,
  text,
  show = (said) => said,
}: {
  drive: string
  text: string
  show?: (said: string) => ReactNode
}) {
  const t = useT()
  const texts = useTexts(drive)
  const both = useOriginal()
  if (texts === null || text === '') return show(text)
  const said = texts.get(text)
  if (said === undefined) {
    return (
      <span lang="en">
        {show(text)}{' '}
        <small className="untranslated" title={t('profileText.untranslated')}>
          {t('profileText.mark')}
        </small>
      </span>
    )
  }
  if (said === text) return show(text)
  return (
    <>
      <span title={text}>{show(said)}</span>
      {both && (
        <span className="original" lang="en">
          {text}
        </span>
      )}
    </>
  )
}

/** The English text next to a translation that is already shown, where somebody wants it there. */
export function Original({ text, shown }: { text: string | undefined; shown: string }) {
  const both = useOriginal()
  if (!both || !text || text === shown) return null
  return (
    <span className="original" lang="en">
      {text}
    </span>
  )
}

/** Shows the English originals next to the translated texts, or hides them. */
export function OriginalSwitch() {
  const t = useT()
  const language = useLanguage()
  const both = useOriginal()
  if (language === 'en') return null
  return (
    <label className="original-switch">
      <input
        type="checkbox"
        checked={both}
        onChange={(event) => setOriginal(event.currentTarget.checked)}
      />{' '}
      {t('profileText.original')}
    </label>
  )
}
