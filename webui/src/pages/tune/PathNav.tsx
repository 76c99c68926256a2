import { href } from '../../app/router'
import { useT } from '../../i18n'
import { Icon } from '../../widgets/Icon'
import { type Known, nextStep, STEPS, stepsDone } from './path'

/** Steps that are done on the page Response. */
const ELSEWHERE = new Set(['response', 'notches', 'verify'])

/** The guided path: what is done, what comes next, and the way to each step. */
export function PathNav({ drive, known }: { drive: string; known: Known }) {
  const t = useT()
  const done = stepsDone(known)
  const next = nextStep(done)
  const show = (step: string) =>
    document.getElementById(`step-${step}`)?.scrollIntoView({ behavior: 'smooth', block: 'start' })
  return (
    <nav aria-label={t('path.title')}>
      <ol className="path">
        {STEPS.map((step, i) => (
          <li key={step}>
            <a
              className={done[step] ? 'done' : step === next ? 'next' : ''}
              aria-current={step === next ? 'step' : undefined}
              href={ELSEWHERE.has(step) ? href('response', drive) : href('tune', drive)}
              onClick={(event) => {
                if (ELSEWHERE.has(step)) return
                event.preventDefault()
                show(step)
              }}
            >
              <strong>
                {i + 1} {t(`path.${step}`)}
                {/* It keeps its place, so that a step that is done or undone moves no other. */}
                <span style={{ visibility: done[step] ? 'visible' : 'hidden' }}>
                  <Icon name="check" size={16} />
                </span>
              </strong>
              <small className="dim">
                {t(done[step] ? 'path.done' : step === next ? 'path.next' : 'path.open')}
              </small>
            </a>
          </li>
        ))}
      </ol>
    </nav>
  )
}
