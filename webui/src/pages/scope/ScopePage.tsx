import { ActionIcon, Button, NativeSelect, useComputedColorScheme } from '@mantine/core'
import { useCallback, useEffect, useRef, useState } from 'react'
import { useRoute } from '../../app/router'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { contents, useDrives, useLink, useRows } from '../../live/store'
import type { TriggerSettings } from '../../live/trigger'
import type { ScopeFrame, ScopeView } from '../../live/worker-messages'
import { type PlotHandle, TimePlot } from '../../plots/TimePlot'
import { Icon } from '../../widgets/Icon'
import { ProblemNote } from '../../widgets/ProblemNote'
import { offerDownload } from '../files/sets'
import { ChannelPicker } from './ChannelPicker'
import {
  type Channel,
  storeChannels,
  storedChannels,
  TRACE_COLORS,
  usualChannels,
} from './channels'
import { Measurements } from './Measurements'
import { type TriggerChoice, TriggerPanel } from './TriggerPanel'
import { useFrames, useScopeInfo, useSubscriptions, useTrigger } from './useScope'

const WINDOWS = [0.2, 0.5, 1, 2, 5, 10, 30, 60]
const TABLE_MS = 250

export function ScopePage() {
  const t = useT()
  const link = useLink()
  const drives = useDrives()
  const { drive: chosen } = useRoute()
  const first = chosen ?? drives?.[0]?.id ?? null
  const rows = useRows(first ?? '')
  const dark = useComputedColorScheme('light') === 'dark'
  const [channels, setChannels] = useState<Channel[] | null>(storedChannels)
  const [picking, setPicking] = useState(false)
  const [window_, setWindow] = useState(5)
  const [stretch, setStretch] = useState<{ from: number; to: number } | null>(null)
  const [frozenAt, setFrozenAt] = useState<number | null>(null)
  const [paused, setPaused] = useState(false)
  const [cursors, setCursors] = useState<number[]>([])
  const [choice, setChoice] = useState<TriggerChoice>({
    mode: 'off',
    kind: 'rising',
    level: 0,
    before: 0.2,
    index: 0,
  })
  const [table, setTable] = useState<ScopeFrame | null>(null)
  const plot = useRef<PlotHandle | null>(null)
  const lastFrame = useRef<ScopeFrame | null>(null)
  const tableAt = useRef(0)

  useEffect(() => {
    if (link.open && first && !contents.rows.has(first)) void live.loadRows(first).catch(() => {})
  }, [link.open, first])
  useEffect(() => {
    if (channels === null && first && rows) setChannels(usualChannels(first, rows))
  }, [channels, first, rows])
  const known = (channels ?? []).filter((each) => drives?.some((drive) => drive.id === each.drive))
  const traces = useSubscriptions(known, 0)
  const info = useScopeInfo()
  const described = traces.map((ref) => info.get(ref.subscription)?.channels[ref.channel] ?? null)
  const problems = [...new Set(traces.map((ref) => ref.subscription))].flatMap(
    (id) => info.get(id)?.problem ?? [],
  )
  const name = (i: number) => {
    const channel = known[i]
    const owner = drives?.find((drive) => drive.id === channel?.drive)?.name ?? ''
    return `${owner} ${described[i]?.name ?? channel?.key ?? ''}`.trim()
  }
  const palette = TRACE_COLORS[dark ? 'dark' : 'light']
  const series = known.map((_, i) => ({
    label: name(i),
    unit: described[i]?.unit ?? '',
    color: palette[i % palette.length] as string,
  }))
  const trigger: TriggerSettings | null =
    choice.mode === 'off'
      ? null
      : { kind: choice.kind, level: choice.level, window: window_, before: choice.before }
  useTrigger(traces[choice.index] ?? null, trigger)

  const view = (): ScopeView | null =>
    traces.length === 0
      ? null
      : {
          traces,
          show: stretch ?? (trigger ? { trigger: 'newest' } : { window: window_ }),
          bins: Math.round(plot.current?.width() ?? 600),
          measure:
            cursors.length === 2 ? { from: Math.min(...cursors), to: Math.max(...cursors) } : null,
          cursors,
        }
  const show = (frame: ScopeFrame) => {
    lastFrame.current = frame
    const fresh = stretch === null
    const origin = fresh ? (frame.triggeredAt ?? frame.newest ?? 0) : (frozenAt ?? frame.to)
    const level = series[choice.index]
    plot.current?.draw({
      columns: frame.columns,
      from: frame.from,
      to: frame.to,
      origin: trigger === null && fresh ? (frame.newest ?? 0) : origin,
      level:
        trigger && level ? { unit: level.unit, value: choice.level, color: level.color } : null,
      cursors,
    })
    if (performance.now() - tableAt.current > TABLE_MS || paused) {
      tableAt.current = performance.now()
      setTable(frame)
    }
    if (choice.mode === 'single' && frame.triggeredAt !== null && fresh) freeze(frame)
  }
  const freeze = (frame: ScopeFrame) => {
    setStretch({ from: frame.from, to: frame.to })
    setFrozenAt(frame.triggeredAt ?? frame.newest)
  }
  const follow = () => {
    setStretch(null)
    setFrozenAt(null)
    setPaused(false)
    setCursors([])
    if (choice.mode === 'single') setChoice({ ...choice })
  }
  const toStretch = useCallback((from: number, to: number) => {
    setFrozenAt((old) => old ?? lastFrame.current?.triggeredAt ?? lastFrame.current?.newest ?? null)
    setStretch({ from, to })
  }, [])
  useFrames(
    view,
    !paused,
    JSON.stringify([traces, stretch, window_, trigger, cursors, dark, series]),
    show,
  )

  const toggleCursors = () => {
    const frame = lastFrame.current
    if (cursors.length > 0) setCursors([])
    else if (frame) {
      const width = frame.to - frame.from
      // Cursors stand on samples; a picture that runs on would slide away beneath them.
      if (!stretch) freeze(frame)
      setCursors([frame.from + width / 3, frame.from + (2 * width) / 3])
    }
  }
  const pan = (part: number) => {
    const frame = lastFrame.current
    if (!frame) return
    const by = (frame.to - frame.from) * part
    toStretch(frame.from + by, frame.to + by)
  }
  const zoom = (factor: number) => {
    const frame = lastFrame.current
    if (!frame) return
    const centre = (frame.from + frame.to) / 2
    const half = ((frame.to - frame.from) / 2) * factor
    toStretch(centre - half, centre + half)
  }
  const csv = async () => {
    const frame = lastFrame.current
    if (!frame) return
    const names = series.map((each) => (each.unit ? `${each.label} [${each.unit}]` : each.label))
    const text = await live.scopeCsv(traces, names, frame.from, frame.to)
    offerDownload(`scope ${new Date().toISOString().replaceAll(':', '.')}.csv`, [text], 'text/csv')
  }
  const choose = (next: Channel[]) => {
    storeChannels(next)
    setChannels(next)
  }
  return (
    <div className="page fill scope-page">
      <div className="row wrap middle">
        <h1 className="grow">{t('page.scope')}</h1>
        <Button onClick={() => setPicking(true)} leftSection={<Icon name="scope" />}>
          {t('scope.channels', { count: known.length })}
        </Button>
        <Button
          leftSection={<Icon name={stretch || paused ? 'play' : 'pause'} />}
          onClick={() => {
            if (stretch || paused) follow()
            else if (lastFrame.current) {
              freeze(lastFrame.current)
              setPaused(false)
            }
          }}
        >
          {t(stretch ? 'scope.follow' : 'scope.pause')}
        </Button>
        <NativeSelect
          aria-label={t('scope.window')}
          value={String(window_)}
          onChange={(event) => {
            setWindow(Number(event.currentTarget.value))
            setStretch(null)
          }}
          data={WINDOWS.map((each) => ({
            value: String(each),
            label: t('scope.seconds', { value: each }),
          }))}
        />
        <ActionIcon aria-label={t('scope.panLeft')} onClick={() => pan(-0.25)}>
          <Icon name="left" />
        </ActionIcon>
        <ActionIcon aria-label={t('scope.panRight')} onClick={() => pan(0.25)}>
          <Icon name="right" />
        </ActionIcon>
        <Button aria-label={t('scope.zoomIn')} onClick={() => zoom(0.5)}>
          +
        </Button>
        <Button aria-label={t('scope.zoomOut')} onClick={() => zoom(2)}>
          −
        </Button>
        <Button aria-pressed={cursors.length > 0} onClick={toggleCursors}>
          {t('scope.cursors')}
        </Button>
        <Button leftSection={<Icon name="download" />} onClick={() => void csv()}>
          {t('scope.csv')}
        </Button>
      </div>
      {problems.map((problem) => (
        <ProblemNote key={problem.detail} problem={problem} />
      ))}
      {known.length === 0 && <p className="empty">{t('scope.empty')}</p>}
      {known.length > 0 && (
        <TimePlot
          series={series}
          dark={dark}
          label={t('page.scope')}
          timeLabel={t('scope.time')}
          handle={(next) => {
            plot.current = next
          }}
          onStretch={toStretch}
          onFollow={follow}
          onCursor={(index, time) => setCursors((old) => old.with(index, time))}
        />
      )}
      {known.length > 0 && (
        <>
          <TriggerPanel
            choice={choice}
            names={series.map((each) => each.label)}
            unit={series[choice.index]?.unit ?? ''}
            waiting={trigger !== null && table !== null && table.triggeredAt === null}
            onChange={(next) => {
              setStretch(null)
              setCursors([])
              setChoice(next)
            }}
          />
          <Measurements
            frame={table}
            series={series}
            synchronous={described.map((each) => each?.synchronous ?? null)}
            cursors={cursors}
          />
        </>
      )}
      {picking && (
        <ChannelPicker channels={known} onChange={choose} onClose={() => setPicking(false)} />
      )}
    </div>
  )
}
