import { SegmentedControl, useComputedColorScheme } from '@mantine/core'
import { useCallback, useEffect, useRef, useState } from 'react'
import { useRoute } from '../../app/navigation/router'
import type { ScopeSetup } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { contents, useDrives, useLink } from '../../live/store'
import type { ScopeFrame, ScopeView } from '../../live/worker/worker-messages'
import { type PlotHandle, TimePlot } from '../../plots/TimePlot'
import type { Span } from '../../plots/geometry/yscale'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useRows } from '../../widgets/profile-text/rows'
import { offerDownload } from '../../widgets/browser/download'
import { ChannelPicker } from './setup/ChannelPicker'
import { TRACE_COLORS, usualChannels } from './setup/channels'
import { Cursors } from './analysis/Cursors'
import { KeepPanel } from './recording/KeepPanel'
import { MathsPanel } from './analysis/MathsPanel'
import { Measurements } from './analysis/Measurements'
import type { PanelProps } from './panels'
import { RangePanel } from './analysis/RangePanel'
import { referenceOverlays, sweepOverlays, useReferences } from './recording/references'
import './scope.css'
import {
  needsDrive,
  needsLevel,
  rangesOf,
  type Shown,
  triggerOf,
  withoutGoneAxis,
  withChannels,
  withRange,
} from './setup/setup'
import { SpectrogramPanel } from './analysis/SpectrogramPanel'
import { SpectrumPanel } from './analysis/SpectrumPanel'
import { Toolbar } from './setup/Toolbar'
import { TriggerPanel } from './setup/TriggerPanel'
import {
  type ChangeSetup,
  useFrames,
  useSampling,
  useScopeChannels,
  useScopeInfo,
  useSetup,
  useTrigger,
} from './useScope'
import { useShown } from './setup/useShown'
import { XyPanel } from './analysis/XyPanel'

const TABLE_MS = 250
const FRAME_MS = 40
/** A picture that stands is asked for again only for what is next to it. */
const FROZEN_MS = 500
const TABS = ['measure', 'spectrum', 'spectrogram', 'xy', 'maths', 'keep'] as const
type Tab = (typeof TABS)[number]

interface Frozen {
  from: number
  to: number
  /** Time that is shown as zero. */
  origin: number
}

export function ScopePage() {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const [setup, change] = useFirstSetup()
  const infos = useScopeChannels()
  const shown = useShown(setup, infos)
  const palette = TRACE_COLORS[dark ? 'dark' : 'light']
  const colors = shown.map((_, i) => palette[i % palette.length] as string)
  const problems = [...useScopeInfo().values()].flatMap((info) => info.problem ?? [])
  const [picking, setPicking] = useState(false)
  const [tab, setTab] = useState<Tab>('measure')
  const [arming, setArming] = useState(0)
  const [frozen, setFrozen] = useState<Frozen | null>(null)
  const [cursors, setCursors] = useState<number[]>([])
  const [references, setReferences] = useReferences()
  const [table, setTable] = useState<ScopeFrame | null>(null)
  const plot = useRef<PlotHandle | null>(null)
  const last = useRef<ScopeFrame | null>(null)
  const tableAt = useRef(0)
  const tabs = useRef<HTMLDivElement>(null)
  const sought = withoutGoneAxis(setup, useDrives())
  const trigger = triggerOf(sought, infos)
  const ranges = rangesOf(setup)
  const rescale = (unit: string, span: Span | null) => change((now) => withRange(now, unit, span))
  const fit = () => change({ ...setup, ranges: [] })
  useSampling(sought, infos)
  useTrigger(sought, infos, arming)

  const view = (): ScopeView | null =>
    shown.length === 0
      ? null
      : {
          ids: shown.map((each) => each.id),
          show: frozen ?? (trigger ? { trigger: 'newest' } : { window: setup.window_s }),
          bins: Math.round(plot.current?.width() ?? 600),
          measure:
            tab === 'measure' && tableDue(tableAt.current, frozen !== null)
              ? (between(cursors) ?? 'shown')
              : null,
          cursors,
          persistence: setup.persistence > 0,
        }
  const originOf = (frame: ScopeFrame) => frozen?.origin ?? frame.trigger.at ?? frame.newest ?? 0
  const freeze = (frame: ScopeFrame) =>
    setFrozen({ from: frame.from, to: frame.to, origin: originOf(frame) })
  const draw = (frame: ScopeFrame) => {
    last.current = frame
    const level = levelOf(setup, shown, colors)
    plot.current?.draw({
      columns: frame.columns,
      from: frame.from,
      to: frame.to,
      origin: originOf(frame),
      level: trigger ? level : null,
      cursors,
      overlays: [
        ...sweepOverlays(frame.overlays, shown, colors),
        ...referenceOverlays(references, palette),
      ],
      ranges,
    })
    if (frame.measurements !== null || (tab !== 'measure' && tableDue(tableAt.current, false))) {
      tableAt.current = performance.now()
      setTable(frame)
    }
    const caught = trigger?.mode === 'single' && frame.trigger.state === 'triggered'
    if (caught && frozen === null) freeze(frame)
  }
  useFrames(
    view,
    frozen ? FROZEN_MS : FRAME_MS,
    JSON.stringify([
      shown,
      frozen,
      setup.window_s,
      trigger,
      cursors,
      dark,
      tab,
      references.length,
      setup.ranges,
    ]),
    draw,
  )

  const follow = () => {
    setFrozen(null)
    setCursors([])
    if (setup.trigger.mode === 'single') setArming((n) => n + 1)
  }
  const toStretch = useCallback((from: number, to: number) => {
    const frame = last.current
    const origin = frame?.trigger.at ?? frame?.newest ?? to
    setFrozen((old) => ({ from, to, origin: old?.origin ?? origin }))
  }, [])
  const move = (part: number, factor: number) => {
    const now = frozen ?? last.current
    if (!now) return
    const width = now.to - now.from
    const centre = (now.from + now.to) / 2 + width * part
    toStretch(centre - (width * factor) / 2, centre + (width * factor) / 2)
  }
  const toggleCursors = () => {
    const frame = last.current
    if (cursors.length > 0 || !frame) return setCursors([])
    // Cursors stand on samples; a picture that runs on would slide away beneath them.
    if (!frozen) freeze(frame)
    const { from, to } = frozen ?? frame
    setCursors([from + (to - from) / 3, from + (2 * (to - from)) / 3])
  }
  const csv = async () => {
    const frame = last.current
    if (!frame) return
    const text = await live.askScope('csv', {
      ids: shown.map((each) => each.id),
      names: shown.map(({ label, unit }) => (unit ? `${label} [${unit}]` : label)),
      from: frame.from,
      to: frame.to,
      origin: frame.from,
    })
    offerDownload(`scope ${new Date().toISOString().replaceAll(':', '.')}.csv`, [text], 'text/csv')
  }
  const changeFromNow = (next: ScopeSetup) => {
    setFrozen(null)
    setCursors([])
    change(next)
  }
  const panel: PanelProps = {
    shown,
    colors,
    stretch: () => {
      const frame = last.current
      if (!frame) return null
      const over = between(cursors) ?? { from: frame.from, to: frame.to }
      return { ...over, origin: originOf(frame) }
    },
    running: frozen === null,
    change: JSON.stringify([frozen, cursors]),
    dark,
  }
  return (
    <div className="page scope-page">
      <Toolbar
        count={shown.length}
        window_s={setup.window_s}
        frozen={frozen !== null}
        cursors={cursors.length > 0}
        fixed={setup.ranges.length > 0}
        onPick={() => setPicking(true)}
        onRun={() => {
          if (frozen) follow()
          else if (last.current) freeze(last.current)
        }}
        onWindow={(window_s) => changeFromNow({ ...setup, window_s })}
        onMove={move}
        onCursors={toggleCursors}
        onFit={fit}
        onCsv={() => void csv()}
      />
      {problems.map((problem) => (
        <ProblemNote key={problem.detail} problem={problem} />
      ))}
      {shown.length === 0 && <p className="empty">{t('scope.empty')}</p>}
      {shown.length > 0 && (
        <TimePlot
          series={shown.map(({ label, unit }, i) => ({ label, unit, color: colors[i] as string }))}
          dark={dark}
          label={t('page.scope')}
          timeLabel={t('scope.time')}
          handle={(next) => {
            plot.current = next
          }}
          onStretch={toStretch}
          onFollow={follow}
          onCursor={(index, time) => setCursors((old) => old.with(index, time))}
          onRange={rescale}
        />
      )}
      <Cursors
        cursors={cursors}
        origin={frozen?.origin ?? 0}
        onCursor={(index, time) => setCursors((old) => old.with(index, time))}
      />
      {shown.length > 0 && (
        <RangePanel
          units={[...new Set(shown.map(({ unit }) => unit))]}
          ranges={ranges}
          now={(unit) => plot.current?.range(unit) ?? null}
          onRange={rescale}
          onFit={fit}
        />
      )}
      <TriggerPanel
        choice={setup.trigger}
        shown={shown}
        state={table?.trigger ?? null}
        persistence={setup.persistence}
        onChange={(next) => changeFromNow({ ...setup, trigger: next })}
        onPersistence={(persistence) => changeFromNow({ ...setup, persistence })}
        onArm={() => {
          setFrozen(null)
          setCursors([])
          setArming((n) => n + 1)
        }}
      />
      <div className="scope-tabs" ref={tabs}>
        <SegmentedControl
          aria-label={t('scope.tabs')}
          value={tab}
          onChange={(next) => setTab(next)}
          data={TABS.map((each) => ({ value: each, label: t(`scope.tab.${each}`) }))}
        />
      </div>
      {tab === 'measure' && shown.length > 0 && (
        <Measurements frame={table} shown={shown} colors={colors} cursors={cursors} />
      )}
      {tab === 'spectrum' && <SpectrumPanel {...panel} />}
      {tab === 'spectrogram' && <SpectrogramPanel {...panel} />}
      {tab === 'xy' && <XyPanel {...panel} />}
      {tab === 'maths' && (
        <MathsPanel setup={setup} onChange={(maths) => change({ ...setup, maths })} />
      )}
      {tab === 'keep' && (
        <KeepPanel
          {...panel}
          setup={setup}
          references={references}
          onReferences={setReferences}
          onSetup={changeFromNow}
        />
      )}
      <Losses frame={table} />
      {picking && (
        <ChannelPicker setup={setup} onChange={change} onClose={() => setPicking(false)} />
      )}
    </div>
  )
}

const tableDue = (at: number, frozen: boolean) => frozen || performance.now() - at > TABLE_MS

function between(cursors: number[]): { from: number; to: number } | null {
  return cursors.length === 2 ? { from: Math.min(...cursors), to: Math.max(...cursors) } : null
}

/** The line of the trigger's level, on the scale of its trace. */
function levelOf(setup: ScopeSetup, shown: Shown[], colors: string[]) {
  const { kind, trace, level } = setup.trigger
  if (needsDrive(kind) || !needsLevel(kind)) return null
  const place = Math.max(
    0,
    shown.findIndex((each) => each.id === trace),
  )
  const on = shown[place]
  return on ? { unit: on.unit, value: level, color: colors[place] as string } : null
}

/** The stored set-up, or position, speed and torque of the axis where there is none yet. */
function useFirstSetup(): [ScopeSetup, ChangeSetup] {
  const [setup, change, fresh] = useSetup()
  const link = useLink()
  const drives = useDrives()
  const { drive: chosen } = useRoute()
  const first = chosen ?? drives?.[0]?.id ?? null
  const rows = useRows(first ?? '')
  useEffect(() => {
    if (link.open && first && !contents.rows.has(first)) void live.loadRows(first).catch(() => {})
  }, [link.open, first])
  useEffect(() => {
    if (fresh && first && rows) change(withChannels(setup, usualChannels(first, rows)))
  }, [fresh, first, rows, setup, change])
  return [setup, change]
}

/** What the view lost; it is never more than said here. */
function Losses({ frame }: { frame: ScopeFrame | null }) {
  const t = useT()
  const { dropped = 0, blocks = 0, away = 0 } = frame?.losses ?? {}
  const any = dropped + blocks + away > 0
  return (
    <p className={any ? 'note warn num' : 'dim num'} data-lost={dropped + away} role="status">
      {any ? t('scope.losses', { dropped, blocks, away }) : t('scope.lossless')}
    </p>
  )
}
