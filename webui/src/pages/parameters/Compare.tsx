import { Button, Checkbox, NativeSelect } from '@mantine/core'
import { useEffect, useMemo, useRef, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Diff, DiffRow, DriveSummary, ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { Said } from '../../widgets/messages/Said'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { SaveSet, UploadSet } from '../files/sets/SetActions'
import { useSets } from '../files/sets/sets'
import { DiffTable } from './DiffTable'
import { setDiffers, setEdit } from './edits'
import { LoadReport } from './LoadReport'

/** Compare with a file, the defaults or another axis; take over what is ticked. */
export function Compare({ drive, rows }: { drive: DriveSummary; rows: ParameterRow[] }) {
  const t = useT()
  const { sets, refresh, problem: listProblem } = useSets()
  const others = (useDrives() ?? []).filter((each) => each.id !== drive.id)
  const [source, setSource] = useState('defaults')
  const [diff, setDiff] = useState<Diff | null>(null)
  const [ticked, setTicked] = useState<ReadonlySet<string>>(new Set())
  const [all, setAll] = useState(false)
  const compare = useAction()
  const [taken, setTaken] = useState(0)
  const isFile = source.startsWith('file:')

  // What is compared with now: an answer to what was chosen before is dropped.
  const present = useRef(source)
  present.current = source
  const run = (from = source) =>
    compare.run(async () => {
      setTaken(0)
      const query = from.startsWith('file:') ? { file: from.slice(5) } : { against: from }
      const found = await ask(
        api.GET('/api/v1/drives/{drive_id}/diff', {
          params: { path: { drive_id: drive.id }, query },
        }),
      )
      if (present.current !== from) return
      setDiff(found)
      setTicked(new Set(found.rows.filter((row) => row.selected).map((row) => row.key)))
      setDiffers(
        drive.id,
        new Map(
          found.rows
            .filter((row) => row.status === 'differs')
            .map((row) => [row.key, `${found.file}: ${row.file_value ?? '—'} ${row.unit}`]),
        ),
      )
    })
  // Another axis or source: what is on the screen belongs to the old one.
  const origin = `${drive.id} ${source}`
  useEffect(() => {
    setDiff(null)
    setTaken(0)
  }, [origin])
  const shown = useMemo(
    () => (diff?.rows ?? []).filter((row) => all || row.status !== 'same'),
    [diff, all],
  )
  const takeOver = () => {
    let count = 0
    for (const row of diff?.rows ?? []) {
      if (!ticked.has(row.key) || row.file_raw === null) continue
      setEdit(drive.id, row.key, { text: String(row.file_raw), asRaw: true })
      count++
    }
    setTaken(count)
  }
  return (
    <div className="compare">
      <div className="row wrap">
        <NativeSelect
          className="grow"
          label={t('compare.with')}
          value={source}
          onChange={(event) => setSource(event.currentTarget.value)}
          data={[
            { value: 'defaults', label: t('compare.defaults') },
            ...others.map((each) => ({
              value: `drive:${each.id}`,
              label: t('compare.axis', { name: each.name }),
            })),
            ...sets.map((set) => ({
              value: `file:${set.file}`,
              label: t('compare.file', { name: set.file }),
            })),
          ]}
        />
        <Button variant="filled" loading={compare.busy} onClick={() => void run()}>
          {t('compare.run')}
        </Button>
        <SaveSet drive={drive} onSaved={refresh} />
        <UploadSet
          drive={drive}
          onStored={(file) => {
            void refresh()
            setSource(`file:${file}`)
          }}
        />
      </div>
      <ProblemNote problem={compare.problem ?? listProblem} onClose={compare.clear} />
      {diff && (
        <>
          {diff.warnings.map((text, n) => (
            <p key={text} className="note warn" role="alert">
              <Said message={diff.warning_messages?.[n]} words={text} />
            </p>
          ))}
          <div className="row wrap middle">
            <strong>{summary(t, diff.rows)}</strong>
            <span className="grow" />
            <Checkbox
              label={t('compare.all')}
              checked={all}
              onChange={(event) => setAll(event.currentTarget.checked)}
            />
            {isFile ? (
              <LoadReport drive={drive} diff={diff} keys={[...ticked]} onDone={() => void run()} />
            ) : (
              <Button disabled={ticked.size === 0} onClick={takeOver}>
                {t('compare.takeOver', { count: ticked.size })}
              </Button>
            )}
          </div>
          {taken > 0 && <p className="note info">{t('compare.taken', { count: taken })}</p>}
          <DiffTable rows={shown} ticked={ticked} onTick={setTicked} parameters={rows} />
        </>
      )}
    </div>
  )
}

function summary(t: ReturnType<typeof useT>, rows: DiffRow[]): string {
  const differs = rows.filter((row) => row.status === 'differs').length
  const bad = rows.filter((row) => row.status === 'invalid' || row.status === 'not_in_drive').length
  return [
    differs === 0 ? t('compare.none') : t('compare.count', { count: differs }),
    bad > 0 ? t('compare.bad', { count: bad }) : '',
  ]
    .filter(Boolean)
    .join(' · ')
}
