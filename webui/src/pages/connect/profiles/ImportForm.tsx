import { Button, NativeSelect, TextInput } from '@mantine/core'
import { useRef, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DescribedDevice, FoundDrive, ImportedDescription, JobInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { Icon } from '../../../widgets/layout/Icon'
import { JobNote, useJobEnd } from '../../../widgets/jobs/JobNote'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { ImportReport } from './ImportReport'
import { deviceFor, deviceLabel, PROFILE_NAME } from './devices'

const raw = { 'Content-Type': 'application/octet-stream' }
const asIs = (body: unknown) => body as BodyInit

/** A maker's file, or the drive's own list of objects, becomes a profile. */
export function ImportForm({
  found,
  onMade,
}: {
  found?: FoundDrive | undefined
  onMade: (made: ImportedDescription) => void
}) {
  const t = useT()
  const input = useRef<HTMLInputElement>(null)
  const [file, setFile] = useState<File | null>(null)
  const [devices, setDevices] = useState<DescribedDevice[]>([])
  const [device, setDevice] = useState(0)
  const [name, setName] = useState('')
  const [id, setId] = useState<string | null>(null)
  const [made, setMade] = useState<ImportedDescription | null>(null)
  const look = useAction()
  const start = useAction()
  const nameBad = name !== '' && !PROFILE_NAME.test(name)
  useJobEnd(id, (job) => {
    if (job.state !== 'done') return
    const result = job.result as unknown as ImportedDescription
    setMade(result)
    onMade(result)
  })
  const begin = (request: () => Promise<JobInfo>) =>
    start.run(async () => {
      setMade(null)
      const job = await request()
      setJob(job)
      setId(job.id)
    })
  const choose = (chosen: File) =>
    look.run(async () => {
      setFile(chosen)
      setDevices([])
      // What was said of another file must not be mistaken for this one's.
      setId(null)
      setMade(null)
      start.clear()
      const reported = await ask(
        api.POST('/api/v1/descriptions/devices', {
          params: { query: { file: chosen.name } },
          body: chosen as never,
          bodySerializer: asIs,
          headers: raw,
        }),
      )
      setDevices(reported)
      setDevice(deviceFor(reported, found))
    })
  const send = (chosen: File) =>
    begin(() =>
      ask(
        api.POST('/api/v1/descriptions', {
          params: {
            query: {
              file: chosen.name,
              profile: name || null,
              product_code: devices[device]?.product_code ?? null,
              revision: devices[device]?.revision ?? null,
            },
          },
          body: chosen as never,
          bodySerializer: asIs,
          headers: raw,
        }),
      ),
    )
  const read = (drive: FoundDrive) =>
    begin(() =>
      ask(
        api.POST('/api/v1/descriptions/from-drive', {
          body: { url: drive.url, station: drive.station, profile: name },
        }),
      ),
    )
  return (
    <>
      <p className="prose">{t('notListed.lead')}</p>
      <input
        ref={input}
        type="file"
        hidden
        accept=".xml,.esi,.eds,.dcf,text/xml,text/plain"
        aria-label={t('notListed.file')}
        onChange={(event) => {
          const chosen = event.currentTarget.files?.[0]
          event.currentTarget.value = ''
          if (chosen) void choose(chosen)
        }}
      />
      <div className="row">
        <Button
          loading={look.busy}
          leftSection={<Icon name="upload" />}
          onClick={() => input.current?.click()}
        >
          {file ? file.name : t('notListed.choose')}
        </Button>
        {devices.length > 1 && (
          <NativeSelect
            className="grow"
            label={t('notListed.device')}
            value={String(device)}
            onChange={(event) => setDevice(Number(event.currentTarget.value))}
            data={devices.map((each, number) => ({
              value: String(number),
              label: deviceLabel(each),
            }))}
          />
        )}
      </div>
      <div className="row">
        <TextInput
          className="grow"
          label={t('notListed.name')}
          description={t('notListed.nameHelp')}
          value={name}
          maxLength={60}
          spellCheck={false}
          autoCapitalize="off"
          error={nameBad ? t('notListed.nameBad') : null}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Button
          variant="filled"
          disabled={!file || nameBad || look.busy || look.problem !== null}
          loading={start.busy}
          onClick={() => file && void send(file)}
        >
          {t('notListed.import')}
        </Button>
      </div>
      {found && (
        <>
          <p className="dim">{t('notListed.fromDriveHelp')}</p>
          <Button
            disabled={name === '' || nameBad}
            loading={start.busy}
            onClick={() => void read(found)}
          >
            {t('notListed.fromDrive')}
          </Button>
        </>
      )}
      <ProblemNote problem={look.problem ?? start.problem} onClose={look.clear} />
      <JobNote id={id} />
      {made && <ImportReport made={made} found={found} />}
    </>
  )
}
