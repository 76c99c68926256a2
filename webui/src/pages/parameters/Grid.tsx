import {
  type KeyboardEvent,
  useCallback,
  useEffect,
  useLayoutEffect,
  useRef,
  useState,
} from 'react'
import type { ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import type { ShownRow } from '../../widgets/profile-text/shown-row'
import { setEdit, setProblem, useEdits, writeEdits } from './edits'
import { GridRow } from './GridRow'

const FINE_ROW = 36
const COARSE_ROW = 56
const SPARE_ROWS = 8
/** Greatest number of parameters that one watch may ask for (WatchValues). */
const WATCHED = 200

/** Row height: taller where fingers point or the row has two lines. */
function useRowHeight(): number {
  const query = '(pointer: coarse), (max-width: 760px)'
  const [coarse, setCoarse] = useState(() => window.matchMedia(query).matches)
  useEffect(() => {
    const media = window.matchMedia(query)
    const changed = () => setCoarse(media.matches)
    media.addEventListener('change', changed)
    return () => media.removeEventListener('change', changed)
  }, [])
  return coarse ? COARSE_ROW : FINE_ROW
}

/** Thousands of rows, of which only those in sight exist; moved through with the keyboard. */
export function Grid({
  drive,
  profile,
  rows,
  asRaw,
  live: watching,
  chosen,
  onChoose,
}: {
  drive: string
  profile: string
  rows: ShownRow[]
  asRaw: boolean
  live: boolean
  chosen: string | null
  onChoose: (key: string | null) => void
}) {
  const t = useT()
  const box = useRef<HTMLDivElement>(null)
  const height = useRowHeight()
  const [view, setView] = useState({ top: 0, height: 600 })
  const [editing, setEditing] = useState<{ key: string; text: string | null } | null>(null)
  const { edits, problems, differs } = useEdits(drive)
  useLayoutEffect(() => {
    const element = box.current
    if (!element) return
    const observer = new ResizeObserver(() =>
      setView((old) => ({ ...old, height: element.clientHeight })),
    )
    observer.observe(element)
    return () => observer.disconnect()
  }, [])
  const first = Math.max(0, Math.floor(view.top / height) - SPARE_ROWS)
  const last = Math.min(rows.length, Math.ceil((view.top + view.height) / height) + SPARE_ROWS)
  const visible = rows.slice(first, last)
  useWatch(drive, watching, visible)

  const at = rows.findIndex((row) => row.key === chosen)
  const moveTo = (index: number) => {
    const target = Math.min(rows.length - 1, Math.max(0, index))
    const row = rows[target]
    const element = box.current
    if (!row || !element) return
    onChoose(row.key)
    const top = target * height
    if (top < element.scrollTop) element.scrollTop = top
    else if (top + height > element.scrollTop + element.clientHeight) {
      element.scrollTop = top + height - element.clientHeight
    }
  }
  const beginEdit = useCallback((key: string, text: string | null) => setEditing({ key, text }), [])
  const endEdit = useCallback(() => {
    setEditing(null)
    box.current?.focus({ preventScroll: true })
  }, [])
  const onKeyDown = (event: KeyboardEvent<HTMLDivElement>) => {
    if (editing || event.target !== box.current) return
    const page = Math.max(1, Math.floor(view.height / height) - 1)
    const steps: Record<string, number> = {
      ArrowDown: at + 1,
      ArrowUp: at - 1,
      PageDown: at + page,
      PageUp: at - page,
      Home: 0,
      End: rows.length - 1,
    }
    const target = steps[event.key]
    const row = rows[at]
    if (target !== undefined && !event.ctrlKey && !event.metaKey) {
      event.preventDefault()
      moveTo(target)
    } else if (row && event.key === 'Enter' && (event.ctrlKey || event.metaKey)) {
      event.preventDefault()
      void writeEdits(drive, [row.key]).then(
        (problem) => problem && setProblem(drive, row.key, problem),
      )
    } else if (row && (event.key === 'Enter' || event.key === 'F2')) {
      event.preventDefault()
      if (editable(row)) beginEdit(row.key, null)
    } else if (row && event.key === 'Delete') {
      setEdit(drive, row.key, null)
    } else if (row && editable(row) && /^[-+.\d]$/.test(event.key) && !event.ctrlKey) {
      event.preventDefault()
      beginEdit(row.key, event.key)
    }
  }
  return (
    <div className="grid">
      <div className="grid-row grid-head" aria-hidden="true">
        <span />
        <span>{t('column.key')}</span>
        <span>{t('column.name')}</span>
        <span className="right">{t('column.value')}</span>
        <span>{t('column.unit')}</span>
        <span className="wide-only">{t('column.range')}</span>
        <span className="wide-only">{t('column.default')}</span>
        <span>{t('column.marks')}</span>
      </div>
      <div
        ref={box}
        className="grid-body"
        role="grid"
        tabIndex={0}
        aria-rowcount={rows.length}
        aria-label={t('page.parameters')}
        aria-activedescendant={at >= 0 ? `row-${chosen}` : undefined}
        onKeyDown={onKeyDown}
        onScroll={(event) =>
          setView({
            top: event.currentTarget.scrollTop,
            height: event.currentTarget.clientHeight,
          })
        }
      >
        {rows.length === 0 && <p className="empty">{t('parameters.none')}</p>}
        <div style={{ height: rows.length * height, position: 'relative' }}>
          {visible.map((row, i) => (
            <GridRow
              key={row.key}
              drive={drive}
              profile={profile}
              row={row}
              index={first + i}
              top={(first + i) * height}
              height={height}
              asRaw={asRaw}
              chosen={row.key === chosen}
              edit={edits.get(row.key) ?? null}
              problem={problems.get(row.key) ?? null}
              differs={differs.get(row.key) ?? null}
              editing={editing?.key === row.key ? editing : null}
              onChoose={onChoose}
              onBegin={beginEdit}
              onEnd={endEdit}
            />
          ))}
        </div>
      </div>
    </div>
  )
}

export function editable(row: ParameterRow): boolean {
  return row.access !== 'ro' && row.reachable && row.motion !== 'energises'
}

/** Ask for the rows in sight again and again while `watching`. */
function useWatch(drive: string, watching: boolean, visible: ParameterRow[]): void {
  const keys = watching
    ? visible.filter((row) => row.access !== 'wo' && row.reachable).slice(0, WATCHED)
    : []
  const joined = keys.map((row) => row.key).join(' ')
  useEffect(() => {
    if (joined === '') return
    // A short pause: scrolling past must not make the drive's line busy.
    const timer = setTimeout(
      () =>
        live.stand(`values ${drive}`, {
          type: 'watch_values',
          drive,
          keys: joined.split(' '),
          period_s: 0.5,
        }),
      150,
    )
    return () => clearTimeout(timer)
  }, [drive, joined])
  useEffect(() => {
    if (!watching) return
    return () => {
      live.stand(`values ${drive}`, null)
      live.send({ type: 'watch_values', drive, keys: [], period_s: 0.5 })
    }
  }, [drive, watching])
}
