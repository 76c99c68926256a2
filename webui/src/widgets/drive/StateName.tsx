import { known, useLanguage, useT } from '../../i18n'

/**
 * A power state of CiA 402 in the page's language. The manuals print the states in English: a
 * translation stands with the original, in brackets or `below` it, where there is no room beside it.
 */
export function StateName({
  state,
  below = false,
}: {
  state: string
  below?: boolean | undefined
}) {
  const t = useT()
  const translated = useLanguage() !== 'en'
  return (
    <>
      {known(t, 'state', state)}
      {translated &&
        (below ? (
          <small className="original-below" lang="en">
            {state}
          </small>
        ) : (
          <span lang="en">{`（${state}）`}</span>
        ))}
    </>
  )
}
