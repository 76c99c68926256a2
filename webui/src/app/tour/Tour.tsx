import { Button } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { DriveSummary } from '../../api/schema'
import { type Key, useT } from '../../i18n'
import { contents, useAxisState, useDrives, useJobs, useLink, useStore } from '../../live/store'
import { undoneCount } from '../../pages/response/design/undo'
import { Icon } from '../../widgets/layout/Icon'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { go, useRoute } from '../navigation/router'
import { type Before, isDone, isFaulty, PAGE, type Step, STEPS } from './steps'
import { setPlace, useHasTour, usePlace } from './tour'
import './tour.css'

/** The button that a step names, as it is labelled on its page. */
const BUTTON: Partial<Record<Step, Key>> = {
  response: 'sweep.start',
  tune: 'autotune.start',
  fault: 'faults.reset',
  undo: 'undo.button',
}

/**
 * The guided tour of the demo. It stands below the page and covers nothing. It explains and
 * watches; what moves an axis is pressed on the pages, never here.
 */
export function Tour() {
  const { open } = useLink()
  const has = useHasTour(open)
  const place = usePlace()
  const drives = useDrives()
  const first = drives?.[0] ?? null
  useEffect(() => {
    // The demo opens on its first axis; an address that names a page is followed.
    if (has && first && /^#?\/?$/.test(window.location.hash)) go('overview', first.id)
  }, [has, first?.id])
  if (!has || !first || place === 'left') return null
  return place === 'offer' ? <Offer axis={first} /> : <StepCard axis={first} step={place} />
}

function Offer({ axis }: { axis: DriveSummary }) {
  const t = useT()
  return (
    <aside className="tour" aria-label={t('tour.title')}>
      <p className="grow">{t('tour.offer')}</p>
      <div className="row wrap">
        <Button onClick={() => setPlace('left')}>{t('tour.later')}</Button>
        <Button variant="filled" onClick={() => show('look', axis.id)}>
          {t('tour.start')}
        </Button>
      </div>
    </aside>
  )
}

function show(step: Step, axis: string): void {
  setPlace(step)
  go(PAGE[step], axis)
}

function StepCard({ axis, step }: { axis: DriveSummary; step: Step }) {
  const t = useT()
  const { page } = useRoute()
  const done = useDone(step, axis.id)
  const number = STEPS.indexOf(step)
  const previous = STEPS[number - 1]
  const next = STEPS[number + 1]
  const button = BUTTON[step]
  const words = {
    axis: axis.name,
    page: t(`page.${PAGE[step]}`),
    button: button ? t(button) : '',
    cause: t('tour.cause'),
  }
  const asks = step !== 'look' && step !== 'end'
  return (
    <aside className="tour" aria-label={t('tour.title')} data-step={step}>
      <div className="grow">
        <p>
          <strong>{t(`tour.step.${step}`)}</strong>{' '}
          <small className="dim">{t('tour.place', { now: number + 1, count: STEPS.length })}</small>
        </p>
        <p>
          {t(`tour.text.${step}`, words)}
          {step === 'undo' && !done && !tuned(axis.id) && ` ${t('tour.undoNothing')}`}
        </p>
        <p className="good-text" role="status">
          {done && (
            <>
              <Icon name="check" size={16} /> {t('tour.done')}
            </>
          )}
        </p>
      </div>
      <div className="row wrap">
        {step === 'fault' && !done && <CauseFault axis={axis.id} />}
        {page !== PAGE[step] && (
          <Button onClick={() => go(PAGE[step], axis.id)}>
            {t('tour.open', { page: t(`page.${PAGE[step]}`) })}
          </Button>
        )}
        {next && <Button onClick={() => setPlace('left')}>{t('tour.leave')}</Button>}
        {previous && <Button onClick={() => show(previous, axis.id)}>{t('tour.back')}</Button>}
        {next ? (
          <Button
            variant={asks && !done ? 'default' : 'filled'}
            onClick={() => show(next, axis.id)}
          >
            {t(asks && !done ? 'tour.skip' : 'tour.next')}
          </Button>
        ) : (
          <Button variant="filled" onClick={() => setPlace('left')}>
            {t('tour.end')}
          </Button>
        )}
      </div>
    </aside>
  )
}

/** Whether the axis was tuned since the page was opened, so that there is something to undo. */
const tuned = (axis: string): boolean =>
  [...contents.jobs.values()].some(
    (job) => job.kind === 'autotune' && job.drive === axis && job.state === 'done',
  )

/** Whether the step has been done since it was shown. */
function useDone(step: Step, axis: string): boolean {
  const jobs = useJobs()
  const undone = useStore('undone', undoneCount)
  const state = useAxisState(axis)
  const [before, setBefore] = useState<Before & { step: Step }>(() => begin(step))
  const faulty = state?.fresh === true && isFaulty(state)
  useEffect(() => {
    setBefore((old) => (old.step === step ? old : begin(step)))
  }, [step])
  useEffect(() => {
    if (faulty) setBefore((old) => (old.faulty ? old : { ...old, faulty: true }))
  }, [faulty, step])
  if (before.step !== step) return false
  return isDone(step, axis, before, { jobs: jobs.values(), undone, state })
}

const begin = (step: Step) => ({
  step,
  jobs: new Set(contents.jobs.keys()),
  undone: undoneCount(),
  faulty: false,
})

/** Has the virtual drive report a fault; nothing moves by it. */
function CauseFault({ axis }: { axis: string }) {
  const t = useT()
  const act = useAction()
  const cause = () =>
    act.run(() =>
      ask(
        api.POST('/api/v1/drives/{drive_id}/training-fault', {
          params: { path: { drive_id: axis } },
        }),
      ),
    )
  return (
    <>
      <Button loading={act.busy} onClick={() => void cause()}>
        {t('tour.cause')}
      </Button>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}
