import { memo, useEffect, useRef, useState } from 'react'
import type { ParameterRow, ParameterValue, Problem } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { useReading } from '../../live/store'
import { hexadecimal, isText, isWhole, shown, toValue } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { parseTyped } from '../../widgets/numbers/parse'
import { Original } from '../../widgets/profile-text/ProfileText'
import type { ShownRow } from '../../widgets/profile-text/shown-row'
import { type Edit, setEdit, textAs, toggleFavourite, useFavourites } from './edits'
import { editable } from './Grid'

interface Props {
  drive: string
  profile: string
  row: ShownRow
  index: number
  top: number
  height: number
  asRaw: boolean
  chosen: boolean
  edit: Edit | null
  problem: Problem | null
  differs: string | null
  editing: { text: string | null } | null
  onChoose: (key: string) => void
  onBegin: (key: string, text: string | null) => void
  onEnd: () => void
}

export const GridRow = memo(function GridRow(props: Props) {
  const { drive, profile, row, chosen, edit, asRaw, editing } = props
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const favourite = useFavourites(profile).has(row.key)
  const classes = [
    'grid-row',
    chosen && 'chosen',
    edit && 'is-edited',
    !row.reachable && 'unreachable',
  ]
  return (
    <div
      id={`row-${row.key}`}
      role="row"
      aria-rowindex={props.index + 1}
      aria-selected={chosen}
      className={classes.filter(Boolean).join(' ')}
      style={{ top: props.top, height: props.height }}
      onClick={() => props.onChoose(row.key)}
      onDoubleClick={() => editable(row) && props.onBegin(row.key, null)}
    >
      <span role="gridcell" className="star">
        <button
          type="button"
          tabIndex={-1}
          className={`favourite ${favourite ? 'on' : ''}`}
          aria-label={t(favourite ? 'parameters.unfavourite' : 'parameters.favourite')}
          aria-pressed={favourite}
          onClick={() => toggleFavourite(profile, row.key)}
        >
          <Icon name="star" size={16} />
        </button>
      </span>
      <span role="gridcell" className="key mono">
        {row.number ?? row.key}
      </span>
      <span role="gridcell" className="name" title={hint(row)}>
        {row.name}
        {row.number && <small className="mono"> {row.key}</small>}
        <Original text={row.original?.name} shown={row.name} />
      </span>
      <span role="gridcell" className="value num">
        {editing ? (
          <ValueEditor {...props} reading={reading} begun={editing.text} />
        ) : (
          <ValueCell {...props} reading={reading} />
        )}
      </span>
      <span role="gridcell" className="unit">
        {asRaw ? '' : row.unit}
      </span>
      <span role="gridcell" className="wide-only dim num range">
        {range(row, asRaw)}
      </span>
      <span role="gridcell" className="wide-only dim num">
        {row.default_raw === null
          ? ''
          : String(asRaw ? row.default_raw : toValue(row, row.default_raw))}
      </span>
      <span role="gridcell" className="marks">
        <Marks {...props} reading={reading} />
      </span>
    </div>
  )
})

/** What the name's tooltip says: the help, and the English name that the manual has. */
function hint({ name, help, original }: ShownRow): string {
  return original && original.name !== name ? `${original.name}\n${help}`.trim() : help || name
}

export function range(row: ParameterRow, asRaw: boolean): string {
  if (row.access === 'ro') return ''
  const { min_raw: low, max_raw: high } = row
  if (low === null && high === null) return ''
  const text = (raw: number | null) =>
    raw === null ? '…' : String(asRaw ? raw : toValue(row, raw)).replace('-', '−')
  return `${text(low)} … ${text(high)}`
}

/** What the drive said, never what was typed. */
export function readingText(row: ParameterRow, reading: ParameterValue, asRaw: boolean): string {
  if (!asRaw || reading.raw === null || isText(row.type))
    return shown(row, reading.value, reading.raw)
  return isWhole(reading.raw, row.type)
    ? `${reading.raw} · ${hexadecimal(reading.raw, row.type)}`
    : String(reading.raw)
}

function ValueCell({ row, edit, asRaw, reading, onBegin }: Props & { reading: ParameterValue }) {
  const t = useT()
  const say = useSay()
  const text = readingText(row, reading, asRaw)
  const edited = edit && textAs(row, edit, asRaw)
  if (!editable(row))
    return (
      <span title={say.message(row.unreachable_why_message, row.unreachable_why) || text}>
        {text}
      </span>
    )
  return (
    <button
      type="button"
      tabIndex={-1}
      className="value-button"
      // With what is on it: voice control presses a button by its visible words.
      aria-label={`${t('parameters.edit', { name: row.name })}: ${edit ? `${text} ${edited}` : text}`}
      onClick={(event) => {
        if (event.detail === 1) onBegin(row.key, null)
      }}
    >
      {edit ? (
        <span className="change" title={`${text} → ${edited}`}>
          <s className="dim">{text}</s> <span className="typed">{edited}</span>
        </span>
      ) : (
        text
      )}
    </button>
  )
}

function ValueEditor({
  drive,
  row,
  edit,
  asRaw,
  reading,
  begun,
  onEnd,
}: Props & { reading: ParameterValue; begun: string | null }) {
  const t = useT()
  const start = () => (edit ? textAs(row, edit, asRaw) : editText(row, reading, asRaw))
  const [text, setText] = useState(() => begun ?? start())
  const [typed, setTyped] = useState(begun !== null)
  const input = useRef<HTMLInputElement & HTMLSelectElement>(null)
  const ended = useRef(false)
  const enums = Object.entries(row.enum)
  const meant = parseTyped(row, text, asRaw)
  const change = (next: string) => {
    setText(next)
    setTyped(true)
  }
  useEffect(() => {
    const element = input.current
    element?.focus()
    if (begun === null && element instanceof HTMLInputElement) element.select()
  }, [begun])
  const finish = (keep: boolean, value = text) => {
    if (ended.current) return
    ended.current = true
    // What nobody typed is no edit, although the drive may have another value by now.
    if (keep && typed) {
      const unchanged = value === editText(row, reading, asRaw)
      setEdit(drive, row.key, unchanged ? null : { text: value, asRaw })
    }
    onEnd()
  }
  const keys = (event: React.KeyboardEvent) => {
    event.stopPropagation()
    if (event.key === 'Enter' && meant.ok) finish(true)
    else if (event.key === 'Escape') finish(false)
  }
  if (enums.length > 0) {
    return (
      <select
        ref={input}
        className="cell-editor"
        aria-label={row.name}
        value={text}
        onChange={(event) => change(event.currentTarget.value)}
        onKeyDown={keys}
        onBlur={() => finish(true)}
      >
        {!(text in row.enum) && <option value={text}>{text}</option>}
        {enums.map(([raw, label]) => (
          <option key={raw} value={raw}>
            {raw} · {label}
          </option>
        ))}
      </select>
    )
  }
  return (
    <span className="editor-box">
      <input
        ref={input}
        className="cell-editor num"
        aria-label={row.name}
        aria-invalid={!meant.ok}
        inputMode={row.type === 'STRING' || row.type === 'OCTETS' ? 'text' : 'decimal'}
        value={text}
        onChange={(event) => change(event.currentTarget.value)}
        onKeyDown={keys}
        // An invalid text is not kept: it could never be written.
        onBlur={() => finish(meant.ok)}
      />
      {!meant.ok && (
        <span className="editor-problem" role="alert">
          {t(`typed.${meant.why}`, { limit: meant.limit ?? '' })}
        </span>
      )}
    </span>
  )
}

/** The reading as a text to start editing from. */
export function editText(row: ParameterRow, reading: ParameterValue, asRaw: boolean): string {
  const raw = asRaw || Object.keys(row.enum).length > 0
  const value = raw ? reading.raw : reading.value
  return value === null ? '' : String(value)
}

function Marks({ row, edit, problem, differs, reading }: Props & { reading: ParameterValue }) {
  const t = useT()
  const say = useSay()
  return (
    <>
      {problem && (
        <span className="mark refused" title={problem.detail}>
          {t('mark.refused')}
        </span>
      )}
      {edit && <span className="mark edited">{t('mark.edited')}</span>}
      {reading.pending && (
        <span className="mark unsaved" title={t(`effective.${pendingKey(reading.pending)}`)}>
          {t('mark.pending')}
        </span>
      )}
      {reading.unsaved && <span className="mark unsaved">{t('mark.unsaved')}</span>}
      {differs !== null && (
        <span className="mark differs" title={differs}>
          {t('mark.differs')}
        </span>
      )}
      {reading.error && (
        <span
          className={reading.unused ? 'mark quiet' : 'mark refused'}
          title={say.message(reading.error_message, reading.error)}
        >
          {t(reading.unused ? 'mark.unused' : 'mark.unread')}
        </span>
      )}
      {row.settable === 'stopped' && <span className="mark quiet">{t('mark.stopped')}</span>}
      {row.access === 'ro' && <span className="mark quiet">{t('mark.readOnly')}</span>}
      {row.motion === 'energises' && (
        <span className="mark quiet" title={t('motion.energises')}>
          {t('mark.energises')}
        </span>
      )}
      {!row.reachable && (
        <span
          className="mark quiet"
          title={say.message(row.unreachable_why_message, row.unreachable_why)}
        >
          {t('mark.unreachable')}
        </span>
      )}
    </>
  )
}

const EFFECTIVE = ['now', 'stopped', 'reenable', 'write_settings', 'power_cycle'] as const
type Effective = (typeof EFFECTIVE)[number]

/** The known words of when a value acts; anything newer reads as "not yet". */
export function pendingKey(text: string): Effective | 'later' {
  return EFFECTIVE.find((each) => each === text) ?? 'later'
}
