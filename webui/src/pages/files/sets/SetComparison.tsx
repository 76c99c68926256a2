import { Button, Checkbox, NativeSelect } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { Diff, DriveSummary, LibraryEntry, ThreeWay, VersionInfo } from '../../../api/schema'
import { useRoute } from '../../../app/navigation/router'
import { useT } from '../../../i18n'
import * as live from '../../../live/live'
import { contents, useDrives } from '../../../live/store'
import { Panel } from '../../../widgets/layout/Panel'
import { Said } from '../../../widgets/messages/Said'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useRows } from '../../../widgets/profile-text/rows'
import { useAction } from '../../../widgets/requests/useAction'
import { DiffTable } from '../../parameters/DiffTable'
import { LoadReport } from '../../parameters/LoadReport'
import { useSets } from './sets'
import { ThreeWayTable } from './ThreeWayTable'

/** A set of the library; `version` null is the latest. */
export interface Side {
  entry: LibraryEntry
  version: number | null
}

/** A set, or an earlier version of it, against an axis; with a common base as a third side. */
export function SetComparison({
  theirs,
  onClose,
  onChanged,
}: {
  theirs: Side
  onClose: () => void
  onChanged: () => void
}) {
  const t = useT()
  const drives = useDrives() ?? []
  const { drive: chosen } = useRoute()
  const [axis, setAxis] = useState(
    drives.some((each) => each.id === chosen) ? chosen : (drives[0]?.id ?? null),
  )
  const drive = drives.find((each) => each.id === axis) ?? null
  const [version, setVersion] = useState(theirs.version ?? theirs.entry.latest.number)
  const [base, setBase] = useState('')
  const { sets } = useSets()
  const versions = useVersions(theirs.entry)
  return (
    <Panel
      title={`${t('three.title')}: ${theirs.entry.name}`}
      tools={<Button onClick={onClose}>{t('three.close')}</Button>}
    >
      <div className="library-filters">
        <NativeSelect
          label={t('three.version')}
          value={String(version)}
          onChange={(event) => setVersion(Number(event.currentTarget.value))}
          data={versions.map((each) => ({
            value: String(each.number),
            label:
              each.number === theirs.entry.latest.number
                ? `${each.number} (${t('three.latest')})`
                : String(each.number),
          }))}
        />
        <NativeSelect
          label={t('three.axis')}
          value={axis ?? ''}
          onChange={(event) => setAxis(event.currentTarget.value)}
          data={drives.map((each) => ({ value: each.id, label: each.name }))}
        />
        <NativeSelect
          label={t('three.base')}
          description={t('three.baseHelp')}
          value={base}
          onChange={(event) => setBase(event.currentTarget.value)}
          data={[
            { value: '', label: t('three.noBase') },
            ...versions
              .filter((each) => each.number !== version)
              .map((each) => ({
                value: `${each.number}:${theirs.entry.name}`,
                label: t('library.versionOf', { number: each.number }),
              })),
            ...sets
              .filter((each) => !each.problem && each.file !== theirs.entry.name)
              .map((each) => ({ value: `:${each.file}`, label: each.file })),
          ]}
        />
      </div>
      {drive === null ? (
        <p className="empty">{t('three.noAxis')}</p>
      ) : (
        <Result
          key={`${drive.id} ${version} ${base}`}
          drive={drive}
          file={theirs.entry.name}
          version={version}
          base={base}
          onLoaded={onChanged}
        />
      )}
    </Panel>
  )
}

function useVersions(entry: LibraryEntry): VersionInfo[] {
  const [versions, setVersions] = useState<VersionInfo[]>([entry.latest])
  useEffect(() => {
    let current = true
    const path = { entry_id: entry.id }
    ask(api.GET('/api/v1/library/{entry_id}/versions', { params: { path } }))
      .then((found) => current && setVersions(found))
      .catch(() => {}) // the latest is known; comparing says what is wrong
    return () => {
      current = false
    }
  }, [entry.id])
  return versions
}

function Result({
  drive,
  file,
  version,
  base,
  onLoaded,
}: {
  drive: DriveSummary
  file: string
  version: number
  base: string
  onLoaded: () => void
}) {
  const t = useT()
  const { busy, problem, run, clear } = useAction()
  const [two, setTwo] = useState<Diff | null>(null)
  const [three, setThree] = useState<ThreeWay | null>(null)
  const [ticked, setTicked] = useState<ReadonlySet<string>>(new Set())
  const [all, setAll] = useState(false)
  const parameters = useRows(drive.id)
  useEffect(() => {
    if (!contents.rows.has(drive.id)) void live.loadRows(drive.id).catch(() => {})
  }, [drive.id])
  const compare = () =>
    run(async () => {
      const path = { drive_id: drive.id }
      const split = base.indexOf(':')
      let rows: readonly { key: string; selected: boolean }[]
      if (base === '') {
        const found = await ask(
          api.GET('/api/v1/drives/{drive_id}/diff', { params: { path, query: { file, version } } }),
        )
        setTwo(found)
        setThree(null)
        rows = found.rows
      } else {
        const query = {
          base: base.slice(split + 1),
          base_version: Number(base.slice(0, split)) || null,
          theirs: file,
          theirs_version: version,
        }
        const found = await ask(
          api.GET('/api/v1/drives/{drive_id}/three-way', { params: { path, query } }),
        )
        setThree(found)
        setTwo(null)
        rows = found.rows
      }
      setTicked(new Set(rows.filter((row) => row.selected).map((row) => row.key)))
    })
  const found = two ?? three
  const shownTwo = useMemo(
    () => two?.rows.filter((row) => all || row.status !== 'same') ?? [],
    [two, all],
  )
  const shownThree = useMemo(
    () =>
      three?.rows.filter((row) => all || (row.status !== 'same' && row.status !== 'both')) ?? [],
    [three, all],
  )
  const count = (status: string) => three?.rows.filter((row) => row.status === status).length ?? 0
  const differs = two?.rows.filter((row) => row.status === 'differs').length ?? 0
  return (
    <>
      <div className="row wrap middle">
        <Button variant="filled" loading={busy} onClick={() => void compare()}>
          {t('compare.run')}
        </Button>
        <strong>
          {three &&
            t('three.summary', {
              theirs: count('theirs'),
              drive: count('drive'),
              conflict: count('conflict'),
            })}
          {two && (differs ? t('compare.count', { count: differs }) : t('compare.none'))}
        </strong>
        <span className="grow" />
        {found && (
          <>
            <Checkbox
              label={t('compare.all')}
              checked={all}
              onChange={(event) => setAll(event.currentTarget.checked)}
            />
            <LoadReport
              drive={drive}
              diff={{ ...found, file, version }}
              keys={[...ticked]}
              onDone={() => {
                onLoaded()
                void compare()
              }}
            />
          </>
        )}
      </div>
      <ProblemNote problem={problem} onClose={clear} />
      {found?.warnings.map((text, n) => (
        <p key={text} className="note warn" role="alert">
          <Said message={found.warning_messages?.[n]} words={text} />
        </p>
      ))}
      {three && <p className="dim">{t('three.help')}</p>}
      {two && (
        <DiffTable
          rows={shownTwo}
          ticked={ticked}
          onTick={setTicked}
          parameters={parameters ?? []}
        />
      )}
      {three && (
        <ThreeWayTable
          rows={shownThree}
          ticked={ticked}
          onTick={setTicked}
          parameters={parameters ?? []}
        />
      )}
    </>
  )
}
