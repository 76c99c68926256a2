import { Button } from '@mantine/core'
import type { Problem } from '../../api/schema'
import { useT } from '../../i18n'
import { ProblemNote } from './ProblemNote'

const CHANGED = 'urn:servodeck:changed-meanwhile'

/**
 * Why notes or tags were not saved. Where somebody else changed them meanwhile, that person's text
 * is shown beside the own one, and nothing is overwritten before a person has seen both.
 */
export function ChangedMeanwhile({
  problem,
  mine,
  busy,
  onTake,
  onOverwrite,
  onClose,
}: {
  problem: Problem | null
  /** What was to be saved. */
  mine: { notes: string; tags: string[] }
  busy: boolean
  /** Take the other person's text in place of the own one. */
  onTake: (field: 'notes' | 'tags', theirs: string) => void
  /** Save the own text, now that the other one was seen. */
  onOverwrite: (field: 'notes' | 'tags', theirs: string) => void
  onClose: () => void
}) {
  const t = useT()
  const field = problem?.parameter
  if (problem?.type !== CHANGED || (field !== 'notes' && field !== 'tags')) {
    return <ProblemNote problem={problem} onClose={onClose} />
  }
  const theirs = String(problem.value ?? '')
  const own = field === 'notes' ? mine.notes : mine.tags.join(', ')
  return (
    <div className="note fault" role="alert">
      <p>{t('remarks.changed')}</p>
      <dl>
        <dt>{t('remarks.theirs')}</dt>
        <dd className="notes">{theirs || '—'}</dd>
        <dt>{t('remarks.mine')}</dt>
        <dd className="notes">{own || '—'}</dd>
      </dl>
      <div className="row end wrap">
        <Button onClick={() => onTake(field, theirs)}>{t('remarks.take')}</Button>
        <Button loading={busy} onClick={() => onOverwrite(field, theirs)}>
          {t('remarks.overwrite')}
        </Button>
      </div>
    </div>
  )
}
