import { UNREACHABLE } from '../api/client'
import type { Problem } from '../api/schema'
import { known, useT } from '../i18n'
import { said } from '../i18n/said'
import { FORGOTTEN } from '../live/store'

/** What happened, to which drive and parameter, the limit, and what to try. */
export function ProblemNote({
  problem,
  about,
  onClose,
}: {
  problem: Problem | null
  /** What went wrong and when, where it may be read long afterwards. */
  about?: string
  onClose?: () => void
}) {
  const t = useT()
  if (!problem) return null
  const unreachable = problem.type === UNREACHABLE
  const forgotten = problem.type === FORGOTTEN
  return (
    <div className="note fault" role="alert">
      {about && <p className="dim">{about}</p>}
      <p>
        <strong>
          {unreachable
            ? t('problem.unreachable')
            : known(t, 'problemTitle', problem.title) || t('problem.title')}
        </strong>{' '}
        {forgotten ? t('problem.forgotten') : said(t, problem.detail)}
      </p>
      {problem.limit && (
        <p>
          {t('problem.limit')} <span className="num">{problem.limit}</span>
        </p>
      )}
      {(problem.remedy || unreachable || forgotten) && (
        <p>
          {t('problem.try')}{' '}
          {unreachable
            ? t('problem.unreachableTry')
            : forgotten
              ? t('problem.forgottenTry')
              : said(t, problem.remedy ?? '')}
        </p>
      )}
      {onClose && (
        <button type="button" className="plain" onClick={onClose}>
          {t('close')}
        </button>
      )}
    </div>
  )
}
