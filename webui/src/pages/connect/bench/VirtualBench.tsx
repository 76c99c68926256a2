import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { FoundDrive, JobInfo } from '../../../api/schema'
import { plainResult } from '../../../api/results'
import { useT } from '../../../i18n'
import { contents, setJob, subscribe } from '../../../live/store'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

/** An empty bench with virtual drives at hand: one press finds and connects all of them. */
export function VirtualBench({
  urls,
  onBusy,
}: {
  urls: string[]
  /** The first drive ends the emptiness, but not the work. */
  onBusy: (busy: boolean) => void
}) {
  const t = useT()
  const act = useAction()
  const [step, setStep] = useState('')
  const connectAll = async () => {
    const searches = urls.map(search)
    const used = new Set<string>()
    const nameless: FoundDrive[] = []
    for (const [i, each] of searches.entries()) {
      setStep(t('connect.virtualStep', { url: urls[i] ?? '' }))
      for (const found of await each) {
        if (found.serial === null) nameless.push(found)
        else await connect(found, used)
      }
    }
    // Without a serial number it may be the second port of a drive that is here already.
    for (const found of nameless) {
      if (!used.has(found.matches[0]?.profile ?? '')) await connect(found, used)
    }
  }
  return (
    <>
      <Button
        variant="filled"
        disabled={act.busy}
        onClick={() => {
          onBusy(true)
          void act.run(connectAll).then((good) => {
            setStep('')
            // A problem stays to be read.
            if (good) onBusy(false)
          })
        }}
      >
        {t('connect.virtualAll')}
      </Button>
      <p role="status" className="dim">
        {step || t('connect.virtualHelp')}
      </p>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}

/** Put a drive on the bench with the profile that fits best; `used` learns of it. */
async function connect(found: FoundDrive, used: Set<string>): Promise<void> {
  const profile = found.matches[0]?.profile
  if (!profile) return
  used.add(profile)
  const body = { url: found.url, station: found.station, profile, name: '' }
  await ask(api.POST('/api/v1/drives', { body }))
}

/** All drives of a bus. */
async function search(url: string): Promise<FoundDrive[]> {
  const body = { url, stations: null, stop_after_first: false }
  const begun = await ask(api.POST('/api/v1/scan', { body }))
  setJob(begun)
  const job = await ended(begun.id)
  return (plainResult(job.result).found ?? []) as FoundDrive[]
}

function ended(id: string): Promise<JobInfo> {
  return new Promise((resolve) => {
    const look = () => {
      const job = contents.jobs.get(id)
      if (!job || job.state === 'running') return
      leave()
      resolve(job)
    }
    const leave = subscribe('jobs', look)
    look()
  })
}
