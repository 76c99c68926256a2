import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { LineSearchResult } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob, useJob } from '../../../live/store'
import { JobNote } from '../../../widgets/jobs/JobNote'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

/** A serial line whose baud rate is unknown; virtual wires have none. */
export function isSerial(url: string): boolean {
  return /^(modbus|mlink):\/\/(?!virtual\d+(\?|$))[^?]+/.test(url)
}

/** Baud rate and parity by trying. */
export function LineSearch({
  url,
  stations,
  onFound,
}: {
  url: string
  stations: number[] | null
  onFound: (url: string) => void
}) {
  const t = useT()
  const [id, setId] = useState<string | null>(null)
  const search = useAction()
  const job = useJob(id)
  const result = job?.state === 'done' ? (job.result as unknown as LineSearchResult) : null
  const settings = result?.url
  const start = () =>
    search.run(async () => {
      const begun = await ask(
        api.POST('/api/v1/search-line', {
          body: { url, stations: (stations ?? [1]).slice(0, 16) },
        }),
      )
      setJob(begun)
      setId(begun.id)
    })
  return (
    <>
      <Button
        disabled={job?.state === 'running'}
        loading={search.busy}
        onClick={() => void start()}
      >
        {t('line.search')}
      </Button>
      <p className="dim">{t('line.help')}</p>
      <ProblemNote problem={search.problem} onClose={search.clear} />
      <JobNote id={id} />
      {result && !settings && <p className="note warn">{t('line.none')}</p>}
      {settings && (
        <div className="row middle">
          <span className="grow mono">{t('line.found', { url: settings })}</span>
          <Button variant="filled" onClick={() => onFound(settings)}>
            {t('line.use')}
          </Button>
        </div>
      )}
    </>
  )
}
