import { href } from '../../../app/navigation/router'
import { useT } from '../../../i18n'
import { Icon } from '../../../widgets/layout/Icon'
import { type Known, nextStep, type StepName, STEPS, stepsDone } from './path'

/** The guided path: what is done, what comes next, and the way to each step. */
export function PathNav({
  drive,
  known,
  onOpen,
}: {
  drive: string
  known: Known
  onOpen: (step: StepName) => void
}) {
  const t = useT()
  const done = stepsDone(known)
  const next = nextStep(done)
  const show = (step: StepName) => {
    onOpen(step)
    // It has its height only after it was opened.
    requestAnimationFrame(() => {
      const head = document.querySelector<HTMLElement>(`#step-${step} > summary`)
      head?.focus({ preventScroll: true })
      head?.scrollIntoView({ block: 'start' })
    })
  }
  return (
    <nav aria-label={t('path.title')}>
      <ol className="path">
        {STEPS.map((step, i) => (
          <li key={step}>
            <a
              className={done[step] ? 'done' : step === next ? 'next' : ''}
              aria-current={step === next ? 'step' : undefined}
              href={href('tune', drive)}
              onClick={(event) => {
                event.preventDefault()
                show(step)
              }}
            >
              <strong>
                <span>
                  {i + 1} <span className="path-label">{t(`path.${step}`)}</span>
                </span>
                {/* It keeps its place, so that a step that is done or undone moves no other. */}
                <span style={{ visibility: done[step] ? 'inherit' : 'hidden' }}>
                  <Icon name="check" size={16} />
                </span>
              </strong>
              <small className="dim path-label">
                {t(done[step] ? 'path.done' : step === next ? 'path.next' : 'path.open')}
              </small>
            </a>
          </li>
        ))}
      </ol>
    </nav>
  )
}
