import { Button } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { PreflightFinding, PreflightInfo, PreflightRun } from '../../../api/schema'
import { type T, useLanguage, useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { clock } from '../../../widgets/numbers/format'
import { JobNote, useJobEnd } from '../../../widgets/jobs/JobNote'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { interfaceOf } from './preflight'

type Fix = NonNullable<PreflightFinding['fix']>

/** Whether this computer is punctual enough, and what would help most. */
export function Preflight({ url }: { url: string }) {
  const t = useT()
  const language = useLanguage()
  const name = interfaceOf(url)
  const [info, setInfo] = useState<PreflightInfo | null>(null)
  const [left, setLeft] = useState<string[]>([])
  const [job, setId] = useState<string | null>(null)
  const action = useAction()
  const look = useCallback(
    () =>
      action.run(async () =>
        setInfo(
          await ask(
            api.GET('/api/v1/preflight', { params: { query: { interface: name, language } } }),
          ),
        ),
      ),
    [action.run, name, language],
  )
  const shown = info !== null
  useEffect(() => {
    if (shown) void look()
    // Again in another language or of another interface; not by itself.
  }, [look])
  useJobEnd(job, () => void look())
  const measure = () =>
    action.run(async () => {
      const begun = await ask(
        api.POST('/api/v1/preflight', { body: { interface: name, seconds: 10 } }),
      )
      setJob(begun)
      setId(begun.id)
    })
  const apply = (fix: Fix) =>
    action.run(async () =>
      setInfo(
        await ask(
          api.POST('/api/v1/preflight/fixes', {
            params: { query: { language } },
            body: { fix, interface: name },
          }),
        ),
      ),
    )
  const undo = async () => {
    const went = await action.run(async () =>
      setLeft((await ask(api.DELETE('/api/v1/preflight/fixes'))).left),
    )
    if (went) await look()
  }
  return (
    <Panel
      title={t('preflight.title')}
      tools={
        <>
          <Button loading={action.busy} onClick={() => void look()}>
            {t('preflight.look')}
          </Button>
          <Button loading={action.busy} onClick={() => void measure()}>
            {t('preflight.measure')}
          </Button>
        </>
      }
    >
      <p className="dim">{t('preflight.help')}</p>
      <ProblemNote problem={action.problem} onClose={action.clear} />
      <JobNote id={job} onClose={() => setId(null)} />
      {info && (
        <>
          <Verdicts info={info} />
          <Findings found={info.findings} onFix={(fix) => void apply(fix)} />
          {info.changed.length > 0 && (
            <div className="row middle">
              <span className="grow">{t('preflight.changed', { count: info.changed.length })}</span>
              <Button onClick={() => void undo()}>{t('preflight.undo')}</Button>
            </div>
          )}
          {left.length > 0 && (
            <p className="note warn">{t('preflight.left', { settings: left.join(', ') })}</p>
          )}
          {info.measured && <p>{t('preflight.measured', { when: clock(info.measured) })}</p>}
          {info.runs.map((run) => (
            <Run key={run.period_us} run={run} />
          ))}
        </>
      )}
    </Panel>
  )
}

function Verdicts({ info }: { info: PreflightInfo }) {
  const t = useT()
  return (
    <table>
      <thead>
        <tr>
          <th>{t('preflight.purpose')}</th>
          <th>{t('preflight.verdict')}</th>
        </tr>
      </thead>
      <tbody>
        {info.verdicts.map((one) => (
          <tr key={one.purpose}>
            <td>{one.name}</td>
            <td>{one.words}</td>
          </tr>
        ))}
      </tbody>
    </table>
  )
}

function Findings({ found, onFix }: { found: PreflightFinding[]; onFix: (fix: Fix) => void }) {
  const t = useT()
  if (found.length === 0) return <p className="note good">{t('preflight.none')}</p>
  return (
    <ol>
      {found.map((one, place) => {
        const fix = one.fix
        return (
          <li key={one.code}>
            {place === 0 && <strong>{t('preflight.first')}: </strong>}
            {one.what} <small>({effect(t, one)})</small>
            <div className="dim">{one.remedy}</div>
            {fix && <Button onClick={() => onFix(fix)}>{one.fix_name}</Button>}
          </li>
        )
      })}
    </ol>
  )
}

function effect(t: T, one: PreflightFinding): string {
  if (one.effect === 'delays') {
    return t('preflight.effect.delays', { delay: Math.round(one.delay_us) })
  }
  return t(one.effect === 'blocks' ? 'preflight.effect.blocks' : 'preflight.effect.interrupts')
}

function Run({ run }: { run: PreflightRun }) {
  const t = useT()
  const micro = (value: number) => Math.round(value).toString()
  return (
    <div>
      <h3>
        {t('preflight.cycle', { period: run.period_us })} ·{' '}
        {t(run.fifo ? 'preflight.fifo' : 'preflight.noFifo')}
      </h3>
      <p>
        {t('preflight.figures', {
          missed: run.missed,
          cycles: run.cycles,
          late: micro(run.lateness_999_us),
          most: micro(run.lateness_most_us),
        })}
      </p>
      {run.round_trip_median_us !== null && run.round_trip_most_us !== null && (
        <p>
          {t('preflight.trip', {
            median: micro(run.round_trip_median_us),
            most: micro(run.round_trip_most_us),
          })}
        </p>
      )}
      {run.round_trip === null && run.unanswered > 0 && (
        <p className="note warn">{t('preflight.unanswered')}</p>
      )}
      <Histogram run={run} />
    </div>
  )
}

const WIDE = 10
const HIGH = 60

/** Counts by class of lateness; heights are logarithmic, so that one late cycle is seen. */
function Histogram({ run }: { run: PreflightRun }) {
  const t = useT()
  const counts = run.lateness
  const most = Math.log10(1 + Math.max(...counts))
  return (
    <svg
      role="img"
      aria-label={t('preflight.histogram')}
      viewBox={`0 0 ${counts.length * WIDE} ${HIGH}`}
      width={counts.length * WIDE}
      height={HIGH}
    >
      {counts.map((count, place) => {
        const high = most > 0 ? (HIGH * Math.log10(1 + count)) / most : 0
        const edge = run.edges_us[place]
        const last = run.edges_us[run.edges_us.length - 1] ?? 0
        return (
          <rect
            key={edge ?? 'above'}
            x={place * WIDE}
            y={HIGH - high}
            width={WIDE - 1}
            height={high}
            fill="currentColor"
          >
            <title>
              {edge === undefined
                ? t('preflight.classAbove', { edge: last, count })
                : t('preflight.class', { edge, count })}
            </title>
          </rect>
        )
      })}
    </svg>
  )
}
