import { UNREACHABLE } from '../../api/client'
import type { Problem } from '../../api/schema'
import { problemTitle, useSay, useT } from '../../i18n'
import { FORGOTTEN } from '../../live/store'

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
  const say = useSay()
  if (!problem) return null
  const unreachable = problem.type === UNREACHABLE
  const forgotten = problem.type === FORGOTTEN
  return (
    <div className="note fault" role="alert">
      {about && <p className="dim">{about}</p>}
      <p>
        <strong>{unreachable ? t('problem.unreachable') : problemTitle(t, problem)}</strong>{' '}
        {forgotten ? t('problem.forgotten') : say.detail(problem)}
      </p>
      {problem.limit && (
        <p>
          {t('problem.limit')}{' '}
          <span className="num">{say.message(problem.limit_message, problem.limit)}</span>
        </p>
      )}
      {(problem.remedy || unreachable || forgotten) && (
        <p>
          {t('problem.try')}{' '}
          {unreachable
            ? t('problem.unreachableTry')
            : forgotten
              ? t('problem.forgottenTry')
              : say.remedy(problem)}
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
