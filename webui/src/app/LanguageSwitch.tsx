import { setLanguage, useLanguage, useT } from '../i18n'

const OTHER = { en: 'zh', zh: 'en' } as const

/** The other language by its own name, so that somebody who cannot read this one finds it. */
export function LanguageSwitch() {
  const t = useT()
  const other = OTHER[useLanguage()]
  return (
    <button
      type="button"
      className="plain language"
      lang={other === 'zh' ? 'zh-Hans' : 'en'}
      onClick={() => setLanguage(other)}
    >
      {t(`language.${other}`)}
    </button>
  )
}
