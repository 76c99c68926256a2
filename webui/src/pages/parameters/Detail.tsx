import { ActionIcon, Button, Checkbox, NativeSelect, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import { setReadings, useReading } from '../../live/store'
import { dateTime, hexadecimal, isWhole, toValue } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import {
  type BitField,
  bitFields,
  getField,
  parseTyped,
  setField,
} from '../../widgets/numbers/parse'
import { Original } from '../../widgets/profile-text/ProfileText'
import type { ShownRow } from '../../widgets/profile-text/shown-row'
import { Said } from '../../widgets/messages/Said'
import { useAction } from '../../widgets/requests/useAction'
import { setRecord, useRecord } from '../../widgets/drive/useFunctions'
import { setEdit, useEdits, writeEdits } from './edits'
import { editable } from './Grid'
import { editText, pendingKey, range, readingText } from './GridRow'
import { MotionClass } from './MotionClass'
import { OtherPlace } from './OtherPlace'

/** Everything about one parameter, and its editor: enum, bits, raw and physical. */
export function Detail({
  drive,
  profile,
  row,
  onClose,
}: {
  drive: string
  profile: string
  row: ShownRow
  onClose: () => void
}) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const { edits, problems } = useEdits(drive)
  const edit = edits.get(row.key)
  const act = useAction()
  const read = () =>
    act.run(async () =>
      setReadings(drive, [
        await ask(
          api.GET('/api/v1/drives/{drive_id}/parameters/{key}', {
            params: { path: { drive_id: drive, key: row.key } },
          }),
        ),
      ]),
    )
  const write = () =>
    act.run(async () => {
      const problem = await writeEdits(drive, [row.key])
      if (problem) act.setProblem(problem)
    })
  return (
    <aside className="detail" aria-label={t('parameters.detail')}>
      <header className="row middle">
        <h2 className="grow">
          {row.name} <Original text={row.original?.name} shown={row.name} />
        </h2>
        <ActionIcon aria-label={t('close')} onClick={onClose}>
          <Icon name="cross" />
        </ActionIcon>
      </header>
      <p className="dim mono">
        {[row.number, row.key, row.type, t(`access.${row.access}`)].filter(Boolean).join(' · ')}
      </p>
      <p className="now">
        <span className="num">{readingText(row, reading, false)}</span> {row.unit}
        {isWhole(reading.raw, row.type) && (
          <span className="dim mono">
            {' '}
            {t('parameters.rawValue', { raw: reading.raw })} {hexadecimal(reading.raw, row.type)}
          </span>
        )}
      </p>
      <p className="dim">
        {reading.time
          ? t('parameters.readAt', { time: dateTime(reading.time) })
          : t('parameters.notRead')}
      </p>
      {reading.error && (
        <p className={reading.unused ? 'note' : 'note fault'}>
          <Said message={reading.error_message} words={reading.error} />
        </p>
      )}
      {reading.pending && (
        <p className="note info">{t(`effective.${pendingKey(reading.pending)}`)}</p>
      )}
      {reading.unsaved && <p className="note info">{t('parameters.unsavedHelp')}</p>}
      {!row.reachable && (
        <p className="note warn">
          <Said message={row.unreachable_why_message} words={row.unreachable_why} />
        </p>
      )}
      {editable(row) && <Editor drive={drive} row={row} />}
      {row.motion === 'energises' && <OtherPlace drive={drive} row={row} />}
      <div className="row">
        {row.access !== 'wo' && row.reachable && (
          <Button loading={act.busy} onClick={() => void read()}>
            {t('parameters.read')}
          </Button>
        )}
        {edit && (
          <>
            <Button variant="filled" loading={act.busy} onClick={() => void write()}>
              {t('parameters.write')}
            </Button>
            <Button onClick={() => setEdit(drive, row.key, null)}>
              {t('parameters.discardOne')}
            </Button>
          </>
        )}
      </div>
      <ProblemNote problem={problems.get(row.key) ?? act.problem} />
      <OnWatchList drive={drive} row={row} />
      {row.access !== 'ro' && (
        <MotionClass key={row.key} drive={drive} profile={profile} parameter={row.key} />
      )}
      <Facts row={row} />
    </aside>
  )
}

/** Puts a parameter on the watch list of the Overview page. */
function OnWatchList({ drive, row }: { drive: string; row: ParameterRow }) {
  const t = useT()
  const record = useRecord(drive)
  const act = useAction()
  if (!record || row.access === 'wo' || !row.reachable) return null
  if (record.watch.includes(row.key)) {
    return <p className="dim">{t('watch.onList')}</p>
  }
  const put = () =>
    act.run(async () =>
      setRecord(
        drive,
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/watch', {
            params: { path: { drive_id: drive } },
            body: { keys: [...record.watch, row.key] },
          }),
        ),
      ),
    )
  return (
    <>
      <Button loading={act.busy} onClick={() => void put()}>
        {t('watch.put')}
      </Button>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}

/** The editor of one parameter; `compact` leaves its name to what surrounds it. */
export function Editor({
  drive,
  row,
  compact = false,
}: {
  drive: string
  row: ParameterRow
  compact?: boolean
}) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const edit = useEdits(drive).edits.get(row.key)
  const [typing, setTyping] = useState<string | null>(null)
  const [choice, setChoice] = useState(false)
  // An edit of the table or of a comparison keeps its own scale.
  const asRaw = edit?.asRaw ?? choice
  const current = edit?.text ?? editText(row, reading, asRaw)
  const text = typing ?? current
  const typed = parseTyped(row, text, asRaw)
  const keep = (next: string, raw: boolean) => {
    const same = next === editText(row, reading, raw)
    setChoice(raw)
    setEdit(drive, row.key, same ? null : { text: next, asRaw: raw })
  }
  const fields = bitFields(row)
  const raw = typed.ok && typeof typed.raw === 'number' ? typed.raw : reading.raw
  if (Object.keys(row.enum).length > 0) {
    return (
      <NativeSelect
        {...(compact ? { 'aria-label': row.name } : { label: t('parameters.newValue') })}
        value={text}
        className={edit ? 'edited-field' : ''}
        onChange={(event) => keep(event.currentTarget.value, true)}
        data={[
          ...(text in row.enum ? [] : [{ value: text, label: text || '—' }]),
          ...Object.entries(row.enum).map(([value, label]) => ({
            value,
            label: `${value} · ${label}`,
          })),
        ]}
      />
    )
  }
  return (
    <>
      <TextInput
        {...(compact ? { 'aria-label': row.name } : { label: t('parameters.newValue') })}
        description={range(row, asRaw)}
        className={edit ? 'edited-field' : ''}
        rightSection={asRaw ? null : <span className="unit">{row.unit}</span>}
        rightSectionWidth={asRaw ? 0 : 20 + row.unit.length * 8}
        value={text}
        error={
          typed.ok || text === '' ? null : t(`typed.${typed.why}`, { limit: typed.limit ?? '' })
        }
        onChange={(event) => {
          const next = event.currentTarget.value
          setTyping(next)
          if (parseTyped(row, next, asRaw).ok) keep(next, asRaw)
        }}
        onBlur={() => setTyping(null)}
      />
      {!compact && (row.scale !== 1 || row.offset !== 0) && (
        <Checkbox
          label={t('parameters.typeRaw')}
          checked={asRaw}
          onChange={(event) => {
            setChoice(event.currentTarget.checked)
            setTyping(null)
            setEdit(drive, row.key, null)
          }}
        />
      )}
      {fields.length > 0 && typeof raw === 'number' && (
        <fieldset className="bits">
          <legend>{t('parameters.bits')}</legend>
          {fields.map((field) => (
            <BitEditor
              key={field.low}
              field={field}
              raw={raw}
              onChange={(value) => {
                setTyping(null)
                keep(String(setField(raw, field, value, row.type)), true)
              }}
            />
          ))}
        </fieldset>
      )}
    </>
  )
}

function BitEditor({
  field,
  raw,
  onChange,
}: {
  field: BitField
  raw: number
  onChange: (value: number) => void
}) {
  const t = useT()
  const value = getField(raw, field)
  if (field.width === 1) {
    return (
      <Checkbox
        label={`${field.low}: ${field.label}`}
        checked={value === 1}
        onChange={(event) => onChange(event.currentTarget.checked ? 1 : 0)}
      />
    )
  }
  return (
    <label className="bit-range">
      <input
        type="number"
        min={0}
        max={2 ** field.width - 1}
        value={value}
        aria-label={t('parameters.bitField', { label: field.label })}
        onChange={(event) => {
          const next = Number(event.currentTarget.value)
          if (Number.isInteger(next) && next >= 0 && next < 2 ** field.width) onChange(next)
        }}
      />
      {field.low + field.width - 1}–{field.low}: {field.label}
    </label>
  )
}

function Facts({ row }: { row: ShownRow }) {
  const t = useT()
  const fields = bitFields(row)
  return (
    <>
      {row.help && (
        <p className="prose">
          {row.help} <Original text={row.original?.help} shown={row.help} />
        </p>
      )}
      <dl className="facts">
        <dt>{t('column.range')}</dt>
        <dd className="num">{range(row, false) || '—'}</dd>
        <dt>{t('column.default')}</dt>
        <dd className="num">
          {row.default_raw === null ? '—' : `${toValue(row, row.default_raw)} ${row.unit}`}
        </dd>
        <dt>{t('parameters.scale')}</dt>
        <dd className="num">
          {row.scale}
          {row.offset !== 0 && ` + ${row.offset}`}
        </dd>
        <dt>{t('parameters.effective')}</dt>
        <dd>{t(`effective.${pendingKey(row.effective)}`)}</dd>
        <dt>{t('parameters.settable')}</dt>
        <dd>{t(row.settable === 'stopped' ? 'settable.stopped' : 'settable.any')}</dd>
        {row.motor_individual && (
          <>
            <dt>{t('parameters.individual')}</dt>
            <dd>{t('parameters.individualHelp')}</dd>
          </>
        )}
        <dt>{t('parameters.source')}</dt>
        <dd>{row.source}</dd>
      </dl>
      {row.access === 'ro' && fields.length > 0 && (
        <ul className="plain-list">
          {fields.map((field) => (
            <li key={field.low}>
              {field.width === 1 ? field.low : `${field.low + field.width - 1}–${field.low}`}:{' '}
              {field.label}
            </li>
          ))}
        </ul>
      )}
      {row.also_printed.length > 0 && (
        <div className="note warn">
          <strong>{t('parameters.alsoPrinted')}</strong>
          <ul>
            {row.also_printed.map((text) => (
              <li key={text}>{text}</li>
            ))}
          </ul>
        </div>
      )}
      {row.notes && <p className="dim">{row.notes}</p>}
    </>
  )
}
