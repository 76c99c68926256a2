import { SegmentedControl, useComputedColorScheme } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { known, useT } from '../../i18n'
import { useAxisState, useDrive } from '../../live/store'
import { dateTime } from '../../widgets/format'
import { JobNote, useJobEnd } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useCyclic } from '../motion/SignalPanel'
import { TRACE_COLORS } from '../scope/channels'
import { type Curve, filtered, measuredCurve, notchFor } from './bode'
import { BodePlot, type Marker } from './BodePlot'
import { ExportButtons } from './ExportButtons'
import { Legend } from './Legend'
import { MeasurementList } from './MeasurementList'
import { NotchEditor } from './NotchEditor'
import { PredictionPanel } from './PredictionPanel'
import { CursorTable, MarginList, ResonanceTable } from './Readings'
import { filesOf, type Sweep } from './results'
import { SweepForm } from './SweepForm'
import { useGains } from './useGains'
import { useMeasurements, useSweep } from './useMeasurements'
import { useNotches } from './useNotches'
import { useToolJob } from './useToolJob'

const NO_LINES: number[] = []

export function ResponsePage({ drive }: { drive: string }) {
  const t = useT()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const dark = useComputedColorScheme('light') === 'dark'
  const cyclic = useCyclic(summary, state)
  const { job, note, dismiss } = useToolJob(drive, 'sweep')
  const measured = useMeasurements()
  const [shown, setShown] = useState<string | null>(null)
  const [over, setOver] = useState<string | null>(null)
  const { sweep, problem } = useSweep(shown)
  const other = useSweep(over)
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
  const mechanics = sweep?.kind === 'mechanics'
  return (
    <div className="page">
      <h1>
        {t('page.response')} <small className="dim">{summary.name}</small>
      </h1>
      {state && !cyclic && <p className="note info">{t('tune.needsCyclic')}</p>}
      <div className="response-columns">
        <div className="stack">
          {cyclic && <SweepForm drive={drive} state={state} />}
          <JobNote id={note} onClose={dismiss} />
          <MeasurementList
            list={measured.list}
            problem={measured.problem}
            shown={shown}
            over={over}
            onShow={(file) => {
              setShown(file)
              if (file === over) setOver(null)
            }}
            onOver={setOver}
            onChange={measured.refresh}
          />
        </div>
        <div className="stack">
          <ProblemNote problem={problem ?? other.problem} />
          {shown === null && !problem && <p className="panel empty">{t('response.empty')}</p>}
          {shown !== null && !sweep && !problem && <p className="panel empty">{t('loading')}</p>}
          {sweep && shown !== null && (
            <Measured
              key={shown}
              file={shown}
              sweep={sweep}
              over={other.sweep}
              title={titleOf(
                measured.list.find((each) => each.file === shown),
                t,
              )}
              notches={notches}
              dark={dark}
            />
          )}
          <NotchEditor drive={drive} notches={notches} />
          {mechanics && sweep.trusted && shown !== null && gains && (
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

function titleOf(
  info: { kind: string; drive: string; saved: string | null } | undefined,
  t: ReturnType<typeof useT>,
): string {
  return info ? `${known(t, 'measured', info.kind)} · ${info.drive} · ${dateTime(info.saved)}` : ''
}

/** One response with its cursors, tables and overlays. */
function Measured({
  file,
  sweep,
  over,
  title,
  notches,
  dark,
}: {
  file: string
  sweep: Sweep
  over: Sweep | null
  title: string
  notches: ReturnType<typeof useNotches>
  dark: boolean
}) {
  const t = useT()
  const [range, setRange] = useState<'band' | 'all'>('band')
  const [cursors, setCursors] = useState<[number, number]>(() => startCursors(sweep))
  useEffect(() => setCursors(startCursors(sweep)), [sweep])
  const mechanics = sweep.kind === 'mechanics'
  const preview = mechanics && notches.wanted.some((each) => each !== null) ? notches.preview : null
  const curvesIn = (colors: string[]): Curve[] => {
    const main = measuredCurve(sweep, t('response.measured'), colors[0] ?? '')
    const found = [main]
    if (over) found.push(measuredCurve(over, t('response.other'), colors[3] ?? '', true))
    if (preview?.magnitude_db.length === sweep.frequency_hz.length) {
      found.push(
        filtered(
          main,
          preview.magnitude_db,
          preview.phase_deg,
          t('response.withNotches'),
          colors[1] ?? '',
        ),
      )
    }
    return found
  }
  const words = t('response.measured')
  const curves = useMemo(
    () => curvesIn(TRACE_COLORS[dark ? 'dark' : 'light']),
    [sweep, over, preview, dark, words],
  )
  const ink = dark ? '#e9eef3' : '#0f1820'
  const notchColor = TRACE_COLORS[dark ? 'dark' : 'light'][1] ?? ink
  const markers: Marker[] = [
    ...cursors.map((frequency, i) => ({
      id: `cursor ${i}`,
      label: 'AB'[i] ?? '',
      frequency,
      color: ink,
    })),
    ...notches.wanted.flatMap((each, i) =>
      each && mechanics && notches.shaped
        ? [{ id: `notch ${i}`, label: `▼${i + 1}`, frequency: each.center_hz, color: notchColor }]
        : [],
    ),
  ]
  const move = (id: string, frequency: number) => {
    const index = Number(id.split(' ')[1])
    if (id.startsWith('cursor')) setCursors((old) => old.with(index, frequency) as [number, number])
    const notch = notches.wanted[index]
    if (id.startsWith('notch') && notch) {
      notches.set(index, { ...notch, center_hz: Number(frequency.toPrecision(4)) })
    }
  }
  const [first, last] = [sweep.frequency_hz[0] ?? 1, sweep.frequency_hz.at(-1) ?? 1000]
  const shown: [number, number] =
    range === 'all'
      ? [first, last]
      : [Math.max(first, sweep.valid_band_hz[0]), Math.min(last, sweep.valid_band_hz[1])]
  const nothingFree = notches.wanted.every((each) => each !== null)
  return (
    <Panel
      title={title}
      tools={
        <SegmentedControl
          value={range}
          onChange={(next) => setRange(next)}
          data={[
            { value: 'band', label: t('response.band') },
            { value: 'all', label: t('response.all') },
          ]}
        />
      }
    >
      {sweep.warnings.map((each) => (
        <p key={each} className="note warn">
          {each}
        </p>
      ))}
      <Legend of={curves} />
      <BodePlot
        curves={curves}
        markers={markers}
        band={sweep.valid_band_hz}
        shown={shown[0] < shown[1] ? shown : [first, last]}
        unit={sweep.unit}
        label={t('response.plot')}
        dark={dark}
        onMarker={move}
      />
      <p className="dim">
        {t('response.holds', {
          from: Math.round(sweep.valid_band_hz[0]),
          to: Math.round(sweep.valid_band_hz[1]),
          rate: sweep.sample_rate_hz,
        })}
      </p>
      <CursorTable sweep={sweep} over={over} cursors={cursors} />
      {mechanics && (
        <>
          <h3>{t('resonance.title')}</h3>
          <ResonanceTable
            sweep={sweep}
            onNotch={
              notches.shaped && !nothingFree
                ? (f, damping, height) => notches.add(notchFor(f, damping, height))
                : null
            }
          />
        </>
      )}
      {Object.keys(sweep.margins).length > 0 && (
        <>
          <h3>{t(mechanics ? 'margin.titleMeanwhile' : 'margin.title')}</h3>
          <MarginList margins={sweep.margins} />
        </>
      )}
      <div className="row wrap">
        <ExportButtons
          file={file}
          sweep={sweep}
          curves={curvesIn(TRACE_COLORS.light)}
          title={title}
        />
      </div>
    </Panel>
  )
}

/** Cursors on the first two resonances, or spread over the band. */
function startCursors(sweep: Sweep): [number, number] {
  const found = sweep.resonances.filter((each) => each.kind === 'resonance')
  const [low, high] = sweep.valid_band_hz
  const spread = (share: number) => low * (high / low) ** share
  return [found[0]?.frequency_hz ?? spread(0.3), found[1]?.frequency_hz ?? spread(0.7)]
}
