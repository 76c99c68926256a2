import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef, useState } from 'react'
import type { DriveSummary, MeasurementInfo } from '../../api/schema'
import { known, useT } from '../../i18n'
import { useAxisState, useDrive } from '../../live/store'
import { dateTime } from '../../widgets/numbers/format'
import { JobNote, useJobEnd } from '../../widgets/jobs/JobNote'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { TRACE_COLORS } from '../scope/setup/channels'
import { ImportPanel } from './imported/ImportPanel'
import { useMeasurable } from './measure/useMeasurable'
import { MeasuredPanel } from './MeasuredPanel'
import { MeasurementList } from './MeasurementList'
import { NotchEditor } from './design/NotchEditor'
import { PredictionPanel } from './design/PredictionPanel'
import './response.css'
import { filesOf } from './results'
import { SweepForm } from './measure/SweepForm'
import { useGains } from './design/useGains'
import { ofAxis, ofOneAxis, useMeasurements, useSweep } from './useMeasurements'
import { useNotches } from './design/useNotches'
import { useToolJob } from './useToolJob'

const NO_LINES: number[] = []

export function ResponsePage({ drive }: { drive: string }) {
  const t = useT()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const dark = useComputedColorScheme('light') === 'dark'
  const way = useMeasurable(summary, state)
  const { job, note, dismiss } = useToolJob(drive, 'sweep')
  const measured = useMeasurements()
  const [shown, setShown] = useState<string | null>(null)
  const [over, setOver] = useState<string | null>(null)
  const { content, sweep, problem } = useSweep(shown)
  const other = useSweep(over)
  const opened = useRef('')
  const picture = useRef<HTMLDivElement>(null)
  useEffect(() => {
    // Once for each axis: what is measured elsewhere later takes nobody's picture away.
    if (!summary || !measured.asked || opened.current === drive) return
    opened.current = drive
    setShown(newestOf(measured.list, summary))
    setOver(null)
  }, [drive, summary, measured.asked, measured.list])
  const notches = useNotches(drive, sweep?.frequency_hz ?? NO_LINES)
  const { gains } = useGains(drive)
  useJobEnd(job?.id ?? null, (ended) => {
    const file = filesOf(ended.result).at(-1)
    if (file === undefined) return
    // The response shown until now becomes the one before.
    if (shown !== file) setOver(shown)
    setShown(file)
    void measured.refresh()
  })
  if (!summary) return null
  const predictable = sweep?.kind === 'mechanics' && sweep.trusted && !sweep.imported
  const own = content !== null && ofAxis(content.info, summary)
  const alike = other.sweep?.kind === sweep?.kind ? other.sweep : null
  const otherUnit = sweep && alike && alike.unit !== sweep.unit ? alike.unit : null
  return (
    <div className="page">
      <h1>
        {t('page.response')} <small className="dim">{summary.name}</small>
      </h1>
      {state && !way.possible && <p className="note info">{t('tune.needsCyclic')}</p>}
      <div className="response-columns">
        <div className="stack">
          {way.possible && <SweepForm drive={drive} way={way} />}
          <JobNote id={note} onClose={dismiss} />
          <MeasurementList
            list={measured.list}
            problem={measured.problem}
            shown={shown}
            over={over}
            onShow={(file) => {
              setShown(file)
              if (file === over) setOver(null)
              bringIntoSight(picture.current)
            }}
            onOver={(file) => {
              setOver(file)
              if (file !== null) bringIntoSight(picture.current)
            }}
            onChange={measured.refresh}
          />
          <ImportPanel
            onStored={(file) => {
              if (shown !== null) setOver(shown)
              setShown(file)
              bringIntoSight(picture.current)
              void measured.refresh()
            }}
          />
        </div>
        <div className="stack" ref={picture}>
          <ProblemNote problem={problem ?? other.problem} />
          {shown === null && !problem && <p className="panel empty">{t('response.empty')}</p>}
          {shown !== null && !content && !problem && <p className="panel empty">{t('loading')}</p>}
          {otherUnit !== null && (
            <p className="note warn">
              {t('response.otherUnit', { unit: otherUnit, shown: sweep?.unit ?? '' })}
            </p>
          )}
          {content && sweep && shown !== null && (
            <MeasuredPanel
              key={shown}
              file={shown}
              content={content}
              sweep={sweep}
              over={otherUnit === null ? alike : null}
              sameAxis={other.content !== null && ofOneAxis(other.content.info, content.info)}
              title={titleOf(
                measured.list.find((each) => each.file === shown),
                t,
              )}
              notches={notches}
              dark={dark}
            />
          )}
          <NotchEditor drive={drive} notches={notches} />
          {predictable && !own && <p className="note info">{t('predict.otherAxis')}</p>}
          {predictable && own && shown !== null && gains && (
            <PredictionPanel
              drive={drive}
              file={shown}
              info={gains}
              slots={notches.now ?? []}
              wanted={notches.wanted}
              colors={TRACE_COLORS[dark ? 'dark' : 'light']}
              dark={dark}
            />
          )}
        </div>
      </div>
    </div>
  )
}

/** After a press: where the columns are one below the other, the plot is far from the button. */
function bringIntoSight(column: HTMLElement | null): void {
  const top = column?.getBoundingClientRect().top ?? 0
  if (top < 0 || top > window.innerHeight / 2) column?.scrollIntoView({ block: 'start' })
}

/** The newest usable response of this axis; the list is newest first. */
function newestOf(list: MeasurementInfo[], axis: DriveSummary): string | null {
  const found = list.find(
    (each) => each.problem === '' && each.drive === axis.name && each.profile === axis.profile,
  )
  return found?.file ?? null
}

function titleOf(
  info: { kind: string; drive: string; saved: string | null } | undefined,
  t: ReturnType<typeof useT>,
): string {
  return info ? `${known(t, 'measured', info.kind)} · ${info.drive} · ${dateTime(info.saved)}` : ''
}
