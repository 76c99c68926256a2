import { useEffect } from 'react'
import { createPortal } from 'react-dom'
import type { AxisStopInfo } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { useDrives, useStore } from '../../live/store'
import { Icon } from '../../widgets/layout/Icon'
import { currentReport, dismissReport, stopEverything } from './stop'

const GOOD_NEWS_MS = 6000

/** The STOP button and what it reached. Above everything, dialogs included. */
export function StopButton() {
  const t = useT()
  return createPortal(
    <>
      <button
        type="button"
        className="stop"
        // Down, not click: a finger that slides off the button has still asked for a stop.
        onPointerDown={() => void stopEverything()}
        // Voice control and screen readers press with a click alone, which counts no presses.
        onClick={(event) => {
          if (event.detail === 0) void stopEverything()
        }}
        onKeyDown={(event) => {
          if (event.key !== 'Enter' && event.key !== ' ') return
          event.preventDefault() // the key's own click would come second
          if (!event.repeat) void stopEverything()
        }}
        title={t('stop.help')}
        aria-label={t('stop.help')}
      >
        {t('stop.label')}
      </button>
      <StopReportNote />
    </>,
    document.body,
  )
}

function StopReportNote() {
  const t = useT()
  const say = useSay()
  const report = useStore('stop', currentReport)
  const drives = useDrives() ?? []
  const good = report?.answer && Object.keys(report.answer.failed).length === 0
  useEffect(() => {
    if (!good) return
    const timer = setTimeout(dismissReport, GOOD_NEWS_MS)
    return () => clearTimeout(timer)
  }, [good])
  if (!report) return null
  const name = (id: string) => drives.find((drive) => drive.id === id)?.name ?? id
  const failed = Object.entries(report.answer?.failed ?? {})
  return (
    <div className={`stop-report ${good ? 'good' : ''}`} role="alert">
      {report.answer === null && report.failure === null && (
        <p>{t(report.taken ? 'stop.taken' : 'stop.sent')}</p>
      )}
      {report.failure !== null && (
        <p>
          <strong>{t(report.failure === 'unknown' ? 'stop.unknown' : 'stop.unreachable')}</strong>{' '}
          {t('stop.useHardware')}
        </p>
      )}
      {report.answer && report.answer.stopped.length > 0 && (
        <p>
          <Icon name="check" />{' '}
          {t('stop.reached', { names: report.answer.stopped.map(name).join(', ') })}
        </p>
      )}
      {report.answer && report.answer.stopped.length === 0 && failed.length === 0 && (
        <p>{t('stop.none')}</p>
      )}
      {failed.map(([id, why]) => (
        <Failed
          key={id}
          name={name(id)}
          why={say.message(report.answer?.failed_messages?.[id], why)}
          axis={report.answer?.axes.find((each) => each.drive === id)}
        />
      ))}
      {!good && (
        <button type="button" className="plain" onClick={dismissReport}>
          {t('close')}
        </button>
      )}
    </div>
  )
}

/** One axis that does not stand, by what was measured. */
function Failed({
  name,
  why,
  axis,
}: {
  name: string
  why: string
  axis: AxisStopInfo | undefined
}) {
  const t = useT()
  const say = useSay()
  const problem = axis ? say.message(axis.problem_message, axis.problem) : why
  const speed = axis?.speed == null ? '' : `${axis.speed.toPrecision(3)} ${axis.speed_unit}`
  const key = axis?.verdict === 'coasting' || axis?.verdict === 'still_moving' ? axis.verdict : null
  return (
    <>
      <p>
        <strong>{key ? t(`stop.${key}`, { name, speed }) : t('stop.failed', { name })}</strong>{' '}
        {!key && problem && <>{problem}. </>}
        {t(key === 'coasting' ? 'stop.keepAway' : 'stop.useHardware')}
      </p>
      {axis && axis.steps.length > 0 && (
        <ul>
          {axis.steps.map((step, place) => (
            <li key={place}>
              {t('stop.stepAt', {
                seconds: step.at_s.toFixed(2),
                what: t(`stop.step.${step.code}`),
              })}
              {step.parameter && <> ({step.parameter})</>}
              {!step.done && (
                <>
                  : {t('stop.inVain')} {say.message(step.problem_message, step.problem)}
                </>
              )}
            </li>
          ))}
        </ul>
      )}
    </>
  )
}
