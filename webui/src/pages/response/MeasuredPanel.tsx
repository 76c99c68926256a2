import { SegmentedControl } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import type { MeasurementContent, NotchPreviewInfo } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'
import { TRACE_COLORS } from '../scope/setup/channels'
import { type Curve, filtered, loadCurve, measuredCurve, notchFor } from './plot/bode'
import { BodePlot, type Marker } from './plot/BodePlot'
import { ExportButtons } from './ExportButtons'
import { Legend } from './plot/Legend'
import { ImportedFacts } from './imported/ImportedFacts'
import { guide, LOOP_VIEWS, type LoopView, loopView } from './design/loops'
import { MarkerChips } from './plot/MarkerChips'
import { Origin } from './Origin'
import { CursorTable, MarginList, ResonanceTable } from './plot/Readings'
import type { Sweep } from './results'
import { ShapeHelp } from './plot/ShapeHelp'
import type { Notches } from './design/useNotches'

/** One response with its cursors, tables and overlays. */
export function MeasuredPanel({
  file,
  content,
  sweep,
  over,
  sameAxis,
  title,
  notches,
  dark,
}: {
  file: string
  content: MeasurementContent
  sweep: Sweep
  /** Another response of the same kind and unit. */
  over: Sweep | null
  /** Whether the other one is of the same axis. */
  sameAxis: boolean
  title: string
  notches: Notches
  dark: boolean
}) {
  const t = useT()
  const say = useSay()
  const [range, setRange] = useState<'band' | 'all'>('band')
  const [view, setView] = useState<LoopView>('closed')
  const [cursors, setCursors] = useState<[number, number]>(() => startCursors(sweep))
  useEffect(() => setCursors(startCursors(sweep)), [sweep])
  const mechanics = sweep.kind === 'mechanics'
  const now = useMemo(() => loopView(sweep, view), [sweep, view])
  const before = useMemo(() => (over ? loopView(over, view) : null), [over, view])
  const preview = mechanics && notches.wanted.some((each) => each !== null) ? notches.preview : null
  const colors = TRACE_COLORS[dark ? 'dark' : 'light']
  const names = useCurveNames(view)
  const curves = useMemo(
    () => curvesOf(now, before, preview, mechanics ? null : view, names, colors),
    [now, before, preview, view, mechanics, names.join(), dark],
  )
  const [first, last] = [sweep.frequency_hz[0] ?? 1, sweep.frequency_hz.at(-1) ?? 1000]
  const band = bandShown(sweep, range)
  const markers = markersOf(cursors, mechanics && notches.shaped ? notches : null, colors, dark)
  const move = (id: string, frequency: number) => {
    const index = Number(id.split(' ')[1])
    if (id.startsWith('cursor')) setCursors((old) => old.with(index, frequency) as [number, number])
    const notch = notches.wanted[index]
    if (id.startsWith('notch') && notch) {
      notches.set(index, { ...notch, center_hz: Number(frequency.toPrecision(4)) })
    }
  }
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
      {say.messages(sweep.warning_messages, sweep.warnings).map((each) => (
        <p key={each} className="note warn">
          {each}
        </p>
      ))}
      {!mechanics && (
        <SegmentedControl
          fullWidth
          value={view}
          onChange={(next) => setView(next)}
          data={LOOP_VIEWS.map((each) => ({ value: each, label: t(`predict.${each}`) }))}
        />
      )}
      <Legend of={curves} />
      <BodePlot
        curves={curves}
        markers={markers}
        band={sweep.valid_band_hz}
        shown={band[0] < band[1] ? band : [first, last]}
        unit={sweep.unit}
        label={t('response.plot')}
        dark={dark}
        onMarker={move}
      />
      <MarkerChips markers={markers} range={[first, last]} onMove={move} />
      <p className="dim">
        {t('response.holds', {
          from: Math.round(sweep.valid_band_hz[0]),
          to: Math.round(sweep.valid_band_hz[1]),
          rate: sweep.sample_rate_hz,
        })}
      </p>
      {sweep.load && <p className="dim">{t('response.loadIs')}</p>}
      <CursorTable sweep={now} over={before} cursors={cursors} />
      <ImportedFacts sweep={sweep} />
      {mechanics && <Mechanics sweep={sweep} over={sameAxis ? over : null} notches={notches} />}
      {Object.keys(sweep.margins).length > 0 && (
        <>
          <h3>{t(mechanics ? 'margin.titleMeanwhile' : 'margin.title')}</h3>
          <MarginList margins={sweep.margins} over={over?.margins ?? null} />
        </>
      )}
      <Origin content={content} />
      <div className="row wrap">
        <ExportButtons
          file={view === 'closed' ? file : `${view}-${file}`}
          sweep={now}
          curves={curvesOf(
            now,
            before,
            preview,
            mechanics ? null : view,
            names,
            TRACE_COLORS.light,
          )}
          title={mechanics ? title : `${title} · ${t(`predict.${view}`)}`}
        />
      </div>
    </Panel>
  )
}

/** Resonances, what they mean for the machine, and the way to a notch. */
function Mechanics({
  sweep,
  over,
  notches,
}: {
  sweep: Sweep
  over: Sweep | null
  notches: Notches
}) {
  const t = useT()
  const full = notches.wanted.every((each) => each !== null)
  return (
    <>
      <h3>{t('resonance.title')}</h3>
      <ResonanceTable
        sweep={sweep}
        onNotch={
          notches.shaped && !full
            ? (f, damping, height) => notches.add(notchFor(f, damping, height))
            : null
        }
      />
      <ShapeHelp sweep={sweep} over={over} />
    </>
  )
}

/** Labels of the measured, the compared, the filtered curve, the guide of a view, and the load. */
function useCurveNames(view: LoopView): [string, string, string, string, string] {
  const t = useT()
  return [
    t('response.measured'),
    t('response.other'),
    t('response.withNotches'),
    t(`guide.${view}`),
    t('response.load'),
  ]
}

function curvesOf(
  now: Sweep,
  before: Sweep | null,
  preview: NotchPreviewInfo | null,
  view: LoopView | null,
  names: [string, string, string, string, string],
  colors: string[],
): Curve[] {
  const main = measuredCurve(now, names[0], colors[0] ?? '')
  const found = [main]
  const load = loadCurve(now, names[4], colors[2] ?? '')
  if (load) found.push(load)
  if (before) found.push(measuredCurve(before, names[1], colors[3] ?? '', true))
  if (preview?.magnitude_db.length === now.frequency_hz.length) {
    found.push(filtered(main, preview.magnitude_db, preview.phase_deg, names[2], colors[1] ?? ''))
  }
  if (view) found.push(guide(view, main, names[3], colors[2] ?? ''))
  return found
}

function markersOf(
  cursors: [number, number],
  notches: Notches | null,
  colors: string[],
  dark: boolean,
): Marker[] {
  const ink = dark ? '#e9eef3' : '#0f1820'
  return [
    ...cursors.map((frequency, i) => ({
      id: `cursor ${i}`,
      label: 'AB'[i] ?? '',
      frequency,
      color: ink,
    })),
    ...(notches?.wanted ?? []).flatMap((each, i) =>
      each
        ? [
            {
              id: `notch ${i}`,
              label: `▼${i + 1}`,
              frequency: each.center_hz,
              color: colors[1] ?? ink,
            },
          ]
        : [],
    ),
  ]
}

function bandShown(sweep: Sweep, range: 'band' | 'all'): [number, number] {
  const [first, last] = [sweep.frequency_hz[0] ?? 1, sweep.frequency_hz.at(-1) ?? 1000]
  return range === 'all'
    ? [first, last]
    : [Math.max(first, sweep.valid_band_hz[0]), Math.min(last, sweep.valid_band_hz[1])]
}

/** Cursors on the first valley and the first peak, or spread over the band. */
function startCursors(sweep: Sweep): [number, number] {
  const of = (kind: string) => sweep.resonances.find((each) => each.kind === kind)?.frequency_hz
  const [low, high] = sweep.valid_band_hz
  const spread = (share: number) => low * (high / low) ** share
  const found: [number, number] = [
    of('antiresonance') ?? spread(0.3),
    of('resonance') ?? spread(0.7),
  ]
  return found[0] <= found[1] ? found : [found[1], found[0]]
}
