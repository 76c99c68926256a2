import { known, useLanguage, useT } from '../i18n'

/**
 * A power state of CiA 402 in the page's language. The manuals print the states in English: a
 * translation stands with the original. The badge above every page has it as its title alone.
 */
export function StateName({ state }: { state: string }) {
  const t = useT()
  const translated = useLanguage() !== 'en'
  return (
    <>
      {known(t, 'state', state)}
      {translated && <span lang="en">{`（${state}）`}</span>}
    </>
  )
}
