import { SegmentedControl } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import { useRoute } from '../../app/navigation/router'
import { useT } from '../../i18n'
import { loadRows } from '../../live/live'
import { contents, setJob, useDrive, useLink } from '../../live/store'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useRows } from '../../widgets/profile-text/rows'
import { useAction } from '../../widgets/requests/useAction'
import { Compare } from './Compare'
import { ParameterTable } from './ParameterTable'

/** Drives whose values were read afresh since this page was opened. */
const readOnce = new Set<string>()

/** A fresh read on connecting, so that nothing stale is ever mistaken for the drive's value. */
async function readAfresh(drive: string): Promise<void> {
  if (readOnce.has(drive)) return
  readOnce.add(drive)
  const running = [...contents.jobs.values()].some(
    (job) => job.kind === 'read_all' && job.drive === drive && job.state === 'running',
  )
  const readable = (contents.rows.get(drive) ?? []).filter(
    (row) => row.access !== 'wo' && row.reachable,
  )
  // The state monitor has read a few of them; a whole read leaves hardly any out.
  const known = readable.filter((row) => row.reading.time !== null).length > readable.length / 2
  if (running || known) return
  setJob(
    await ask(
      api.POST('/api/v1/drives/{drive_id}/jobs/read_all', {
        params: { path: { drive_id: drive } },
        body: { keys: null },
      }),
    ),
  )
}

export function ParametersPage({ drive }: { drive: string }) {
  const t = useT()
  const rows = useRows(drive)
  const summary = useDrive(drive)
  const link = useLink()
  const load = useAction()
  const { part } = useRoute()
  const [view, setView] = useState<'table' | 'compare'>('table')
  useEffect(() => {
    if (link.open) {
      void load.run(async () => {
        await loadRows(drive)
        await readAfresh(drive)
      })
    }
  }, [drive, link.open, load.run])
  return (
    <div className="page fill">
      <div className="row middle">
        <h1 className="grow">
          {t('page.parameters')} <small className="dim">{summary?.name}</small>
        </h1>
        <SegmentedControl
          value={view}
          onChange={(next) => setView(next)}
          data={[
            { value: 'table', label: t('parameters.table') },
            { value: 'compare', label: t('parameters.compare') },
          ]}
        />
      </div>
      <ProblemNote problem={load.problem} onClose={load.clear} />
      {rows === null && load.busy && <p className="dim">{t('loading')}</p>}
      {rows && summary && view === 'table' && (
        <ParameterTable key={part} drive={summary} rows={rows} asked={part} />
      )}
      {rows && summary && view === 'compare' && <Compare drive={summary} rows={rows} />}
    </div>
  )
}
