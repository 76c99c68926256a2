import { Button, Checkbox, NativeSelect, TextInput } from '@mantine/core'
import { useCallback, useDeferredValue, useMemo, useRef, useState } from 'react'
import { api, ask } from '../../api/client'
import type { DriveSummary, JobInfo, MessageInfo } from '../../api/schema'
import { Said } from '../../widgets/messages/Said'
import { plainResult } from '../../api/results'
import { useT } from '../../i18n'
import { setJob, useJobs, useReadings } from '../../live/store'
import { JobNote } from '../../widgets/jobs/JobNote'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProcedureButton } from '../../widgets/faults/Procedures'
import { OriginalSwitch } from '../../widgets/profile-text/ProfileText'
import type { ShownRow } from '../../widgets/profile-text/shown-row'
import { useAction } from '../../widgets/requests/useAction'
import { Detail } from './Detail'
import { discardEdits, useEdits, useFavourites, writeEdits, noteDropped } from './edits'
import { FILTERS, type Filter, groups, select, settingsFirst } from './filters'
import { Grid } from './Grid'

/** The parameters of one drive with search, filters, and what can be done with all of them. */
export function ParameterTable({
  drive,
  rows: inProfileOrder,
  asked,
}: {
  drive: DriveSummary
  rows: ShownRow[]
  /** Key of the parameter that a link led to. */
  asked: string | null
}) {
  const t = useT()
  const [search, setSearch] = useState(asked ?? '')
  const [filter, setFilter] = useState<Filter>('all')
  const [group, setGroup] = useState<string | null>(null)
  const [asRaw, setAsRaw] = useState(false)
  const [live, setLive] = useState(false)
  const [chosen, setChosen] = useState<string | null>(asked)
  const searchBox = useRef<HTMLInputElement>(null)
  const rows = useMemo(() => settingsFirst(inProfileOrder), [inProfileOrder])
  const readings = useReadings(drive.id)
  const { edits, differs, dropped } = useEdits(drive.id)
  const favourites = useFavourites(drive.profile)
  const wanted = useDeferredValue(search)
  const byGroup = useMemo(() => groups(rows), [rows])
  const marks = {
    edited: new Set(edits.keys()),
    differs: new Set(differs.keys()),
    favourites,
    readings: readings ?? new Map(),
  }
  const shown = select(rows, { filter, group, search: wanted }, marks)
  const row = rows.find((each) => each.key === chosen) ?? null
  const choose = useCallback((key: string | null) => setChosen(key), [])
  return (
    <div className="parameters">
      <Actions drive={drive} shown={shown} />
      {dropped > 0 && (
        <p className="note warn" role="status">
          {t('parameters.dropped', { count: dropped })}{' '}
          <button type="button" className="plain" onClick={() => noteDropped(drive.id)}>
            {t('close')}
          </button>
        </p>
      )}
      <div className="filters">
        <TextInput
          ref={searchBox}
          className="search"
          type="search"
          aria-label={t('parameters.search')}
          placeholder={t('parameters.search')}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
        />
        <NativeSelect
          className="only-narrow-groups"
          aria-label={t('parameters.group')}
          value={group ?? ''}
          onChange={(event) => setGroup(event.currentTarget.value || null)}
          data={[
            { value: '', label: t('parameters.allGroups', { count: rows.length }) },
            ...byGroup.map(({ name, label, count }) => ({
              value: name,
              label: `${label} (${count})`,
            })),
          ]}
        />
        <fieldset className="chips" aria-label={t('parameters.filter')}>
          {FILTERS.map((each) => (
            <button
              key={each}
              type="button"
              className={`chip mark-${each}`}
              aria-pressed={filter === each}
              onClick={() => setFilter(each)}
            >
              {t(`filter.${each}`)}
              {each === 'edited' && edits.size > 0 && <b> {edits.size}</b>}
              {each === 'unsaved' && drive.unsaved + drive.pending > 0 && (
                <b> {Math.max(drive.unsaved, drive.pending)}</b>
              )}
              {each === 'differs' && differs.size > 0 && <b> {differs.size}</b>}
            </button>
          ))}
        </fieldset>
        <Checkbox
          label={t('parameters.raw')}
          checked={asRaw}
          onChange={(event) => setAsRaw(event.currentTarget.checked)}
        />
        <Checkbox
          label={t('parameters.live')}
          checked={live}
          onChange={(event) => setLive(event.currentTarget.checked)}
        />
        <OriginalSwitch />
      </div>
      <div className="table-and-detail">
        <Grid
          drive={drive.id}
          profile={drive.profile}
          rows={shown}
          asRaw={asRaw}
          live={live}
          chosen={chosen}
          onChoose={choose}
        />
        {row && (
          <Detail
            key={row.key}
            drive={drive.id}
            profile={drive.profile}
            row={row}
            onClose={() => setChosen(null)}
          />
        )}
      </div>
      <p className="dim keys-help">
        {t('parameters.count', { shown: shown.length, all: rows.length })} · {t('parameters.keys')}
      </p>
    </div>
  )
}

function Actions({ drive, shown }: { drive: DriveSummary; shown: ShownRow[] }) {
  const t = useT()
  const { edits, writing, problems } = useEdits(drive.id)
  const act = useAction()
  const jobs = useJobs()
  const [closed, setClosed] = useState<string | null>(null)
  const [old] = useState(() => endedOf(jobs))
  const job = newest(
    [...jobs.values()].filter((each) => each.drive === drive.id && each.kind === 'read_all'),
  )
  const read = (keys: string[] | null) =>
    act.run(async () =>
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/read_all', {
            params: { path: { drive_id: drive.id } },
            body: { keys },
          }),
        ),
      ),
    )
  const write = () =>
    act.run(async () => {
      const problem = await writeEdits(drive.id, [...edits.keys()])
      if (problem) act.setProblem(problem)
    })
  const running = job?.state === 'running'
  return (
    <>
      <div className="row wrap actions">
        <Button disabled={running} onClick={() => void read(null)}>
          {t('parameters.readAll')}
        </Button>
        <Button
          disabled={running || shown.length === 0}
          onClick={() =>
            void read(shown.filter((r) => r.access !== 'wo' && r.reachable).map((r) => r.key))
          }
        >
          {t('parameters.readShown', { count: shown.length })}
        </Button>
        <Button
          variant="filled"
          disabled={edits.size === 0 || writing !== null}
          onClick={() => void write()}
        >
          {writing
            ? t('parameters.writing', { done: writing.done, total: writing.total })
            : t('parameters.writeEdited', { count: edits.size })}
        </Button>
        {edits.size > 0 && (
          <Button disabled={writing !== null} onClick={() => discardEdits(drive.id)}>
            {t('parameters.discard')}
          </Button>
        )}
        <span className="gap" />
        <ProcedureButton drive={drive.id} name="write_settings" label={t('parameters.apply')} />
        <ProcedureButton
          drive={drive.id}
          name="save"
          variant={drive.unsaved > 0 ? 'filled' : 'default'}
          label={
            drive.unsaved > 0
              ? t('parameters.saveCount', { count: drive.unsaved })
              : t('parameters.save')
          }
        />
        <ProcedureButton drive={drive.id} name="restore" label={t('parameters.restore')} />
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {problems.size > 0 && (
        <p className="note fault" role="alert">
          {t('parameters.refused', { count: problems.size })}
        </p>
      )}
      {job && job.id !== closed && !old.has(job.id) && (
        <>
          <JobNote id={job.id} onClose={() => setClosed(job.id)} />
          <ReadFailures job={job} />
        </>
      )}
    </>
  )
}

function ReadFailures({ job }: { job: JobInfo }) {
  const t = useT()
  const result = plainResult(job.result)
  const failed = Object.entries((result.failed ?? {}) as Record<string, string>)
  const messages = (result.failed_messages ?? {}) as Record<string, MessageInfo>
  if (failed.length === 0) return null
  return (
    <details className="note warn">
      <summary>{t('parameters.unread', { count: failed.length })}</summary>
      <ul className="scroll-list">
        {failed.map(([key, why]) => (
          <li key={key}>
            <span className="mono">{key}</span> <Said message={messages[key]} words={why} />
          </li>
        ))}
      </ul>
    </details>
  )
}

/** Jobs that had ended before this page was opened are no news; no clock says which they are. */
const endedOf = (jobs: ReadonlyMap<string, JobInfo>): ReadonlySet<string> =>
  new Set([...jobs.values()].filter((each) => each.ended !== null).map((each) => each.id))

function newest(jobs: JobInfo[]): JobInfo | null {
  return jobs.reduce<JobInfo | null>(
    (last, job) => (last === null || job.started >= last.started ? job : last),
    null,
  )
}
