import '../layout/functions.css'
import { Button } from '@mantine/core'
import { useEffect } from 'react'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import { contents, setJob, useLink, useReading } from '../../live/store'
import { Editor } from '../../pages/parameters/Detail'
import { setEdit, useEdits, writeEdits } from '../../pages/parameters/edits'
import { editable } from '../../pages/parameters/Grid'
import { readingText } from '../../pages/parameters/GridRow'
import { Said } from '../messages/Said'
import { ProblemNote } from '../messages/ProblemNote'
import { Original } from '../profile-text/ProfileText'
import { useRows } from '../profile-text/rows'
import type { ShownRow } from '../profile-text/shown-row'
import { together } from '../requests/together'
import { useAction } from '../requests/useAction'

/** Rows of these keys that a connected port can carry, in the order of the keys. */
export function useReachable(drive: string, keys: readonly string[]): ShownRow[] {
  const rows = useRows(drive) ?? []
  return keys.flatMap((key) => rows.filter((row) => row.key === key && row.reachable))
}

/** Reads parameters; what several forms ask for at once is one job. */
const readKeys = together(async (drive, keys) => {
  setJob(
    await ask(
      api.POST('/api/v1/drives/{drive_id}/jobs/read_all', {
        params: { path: { drive_id: drive } },
        body: { keys },
      }),
    ),
  )
})

/** Raw values as they are before a write, to undo it. */
function rawsOf(drive: string, keys: string[]): Record<string, number> {
  const readings = contents.readings.get(drive)
  const found: Record<string, number> = {}
  for (const key of keys) {
    const raw = readings?.get(key)?.raw
    if (typeof raw === 'number') found[key] = raw
  }
  return found
}

/**
 * A few parameters as a form, as text where the manual has words. Typed values are marked and
 * written together; each is read back.
 */
export function ParameterFields({
  drive,
  keys,
  onWritten,
}: {
  drive: string
  keys: readonly string[]
  /** Raw values that were changed, as they were before, and as they were read back. */
  onWritten?: (before: Record<string, number>, after: Record<string, number>) => void
}) {
  const t = useT()
  const { open } = useLink()
  const rows = useReachable(drive, keys)
  const { edits, problems } = useEdits(drive)
  const act = useAction()
  const edited = rows.filter((row) => edits.has(row.key)).map((row) => row.key)
  const wanted = rows
    .filter((row) => row.access !== 'wo')
    .map((row) => row.key)
    .join(' ')
  useEffect(() => {
    if (open && wanted) void act.run(() => readKeys(drive, wanted.split(' ')))
  }, [drive, open, wanted, act.run])
  const write = () =>
    act.run(async () => {
      const before = rawsOf(drive, edited)
      const problem = await writeEdits(drive, edited)
      if (problem) act.setProblem(problem)
      const now = rawsOf(drive, edited)
      const changed = Object.fromEntries(
        Object.entries(before).filter(([key, raw]) => now[key] !== raw),
      )
      const after = Object.entries(now).filter(([key]) => key in changed)
      if (Object.keys(changed).length > 0) onWritten?.(changed, Object.fromEntries(after))
    })
  if (rows.length === 0) {
    return <p className="dim">{t('fields.none')}</p>
  }
  return (
    <>
      <ul className="parameter-fields">
        {rows.map((row) => (
          <li key={row.key}>
            <Field drive={drive} row={row} />
            <ProblemNote problem={problems.get(row.key) ?? null} />
          </li>
        ))}
      </ul>
      <div className="row wrap">
        {edited.length > 0 && (
          <>
            <Button variant="filled" loading={act.busy} onClick={() => void write()}>
              {t('fields.write', { count: edited.length })}
            </Button>
            <Button
              onClick={() => {
                for (const key of edited) setEdit(drive, key, null)
              }}
            >
              {t('fields.discard')}
            </Button>
          </>
        )}
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}

/** One parameter in a line: what it is, then its editor, or its value where it is read only. */
function Field({ drive, row }: { drive: string; row: ShownRow }) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const edited = useEdits(drive).edits.has(row.key)
  const can = editable(row)
  const reported = row.help || row.notes || row.settable === 'stopped'
  return (
    <>
      <div className="field">
        <div className="field-name">
          <span>{row.name}</span> <small className="dim mono">{row.number ?? row.key}</small>
          <Original text={row.original?.name} shown={row.name} />
          {edited && <span className="mark edited">{t('mark.edited')}</span>}
          {reading.pending && <span className="mark unsaved">{t('fields.waits')}</span>}
          {reading.unsaved && <span className="mark unsaved">{t('fields.unsaved')}</span>}
          {edited && (
            <small className="num">
              {t('gear.now')} {readingText(row, reading, false)} {row.unit}
            </small>
          )}
          {reported && (
            <details>
              <summary aria-label={t('fields.about', { name: row.name })}>?</summary>
              {row.help && (
                <p className="prose">
                  {row.help} <Original text={row.original?.help} shown={row.help} />
                </p>
              )}
              {row.settable === 'stopped' && <p>{t('fields.stopped')}</p>}
              {row.notes && <p className="dim">{row.notes}</p>}
              <p className="dim">{t('source', { source: row.source })}</p>
            </details>
          )}
        </div>
        <div className="field-value">
          {can ? (
            <Editor drive={drive} row={row} compact />
          ) : (
            <strong className="num">
              {readingText(row, reading, false)} <span className="unit">{row.unit}</span>
            </strong>
          )}
        </div>
      </div>
      {reading.error && (
        <p className="note warn">
          <Said message={reading.error_message} words={reading.error} />
        </p>
      )}
    </>
  )
}
