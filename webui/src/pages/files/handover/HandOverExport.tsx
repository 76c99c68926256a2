import { Button, Checkbox, FileInput, NativeSelect, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type {
  DriveSummary,
  HandoverRequest,
  HandoverResult,
  LibraryEntry,
  SegmentAxis,
} from '../../../api/schema'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { SegmentAxes } from './SegmentAxes'
import { offerDownload } from '../../../widgets/browser/download'

type Format = HandoverRequest['format']
type Rows = 'all' | 'tuned' | 'not_default' | 'chosen'

/** Formats with the ending of their files; the order is that of the list. */
const FORMATS: Record<Format, string> = {
  twincat: '.xml',
  codesys: '.csv',
  eni: '.xml',
  lcec: '.xml',
  ros2: '.yaml',
  igh: '.sh',
  dcf: '.dcf',
  csv: '.csv',
  python: '.py',
}
const ROWS: Rows[] = ['all', 'tuned', 'not_default', 'chosen']
/** Formats in which the ESI file says more than the set. */
const WITH_ESI: ReadonlySet<Format> = new Set(['eni', 'lcec', 'ros2'])
/** Formats that hold several drives of one bus. */
const OF_SEGMENTS: ReadonlySet<Format> = new Set(['eni', 'lcec', 'ros2'])
/** Names the server takes (HandoverRequest.file). */
const NAME = /^\w[\w .-]{0,100}$/

/** Which values, in which controller's format; the files are offered for download. */
export function HandOverExport({
  drive,
  entry,
  onMade,
}: {
  drive: DriveSummary
  entry: LibraryEntry
  onMade: () => void
}) {
  const t = useT()
  const stem = entry.name.replace(/\.sdset$/, '').replace(/[^\w .-]/g, '_')
  const [format, setFormat] = useState<Format>('twincat')
  const [file, setFile] = useState(`${stem}.xml`)
  const [rows, setRows] = useState<Rows>('all')
  const [keys, setKeys] = useState('')
  const [individual, setIndividual] = useState(false)
  const [esi, setEsi] = useState<File[]>([])
  const [segment, setSegment] = useState<SegmentAxis[] | null>(null)
  const axes = segment ?? [{ drive_id: drive.id, set_file: entry.name }]
  const [result, setResult] = useState<HandoverResult | null>(null)
  const act = useAction()
  const make = () =>
    act.run(async () => {
      setResult(null)
      const only = keys.split(/[\s,;]+/).filter(Boolean)
      const whole = OF_SEGMENTS.has(format)
      const made = await ask(
        api.POST('/api/v1/handover', {
          body: {
            axes: whole ? axes : [{ drive_id: drive.id, set_file: entry.name }],
            format,
            file,
            choice: rows === 'chosen' ? 'all' : rows,
            only: rows === 'chosen' ? only.map((key) => key.toUpperCase()) : [],
            include_motor_individual: individual,
            esi: WITH_ESI.has(format) ? await Promise.all(esi.map(base64)) : [],
          },
        }),
      )
      setResult(made)
      onMade()
    })
  return (
    <>
      <div className="library-filters">
        <NativeSelect
          label={t('handover.format')}
          value={format}
          onChange={(event) => {
            const next = event.currentTarget.value as Format
            setFormat(next)
            setFile(`${stem}${FORMATS[next]}`)
          }}
          data={(Object.keys(FORMATS) as Format[]).map((each) => ({
            value: each,
            label: t(`handover.format.${each}`),
          }))}
        />
        <NativeSelect
          label={t('handover.rows')}
          value={rows}
          onChange={(event) => setRows(event.currentTarget.value as Rows)}
          data={ROWS.map((each) => ({ value: each, label: t(`handover.rows.${each}`) }))}
        />
        {rows === 'chosen' && (
          <TextInput
            label={t('handover.keys')}
            value={keys}
            onChange={(event) => setKeys(event.currentTarget.value)}
          />
        )}
        <TextInput
          label={t('handover.file')}
          value={file}
          error={NAME.test(file) ? null : t('handover.fileBad')}
          onChange={(event) => setFile(event.currentTarget.value)}
        />
        {WITH_ESI.has(format) && (
          <FileInput
            label={t('handover.esi')}
            description={t('handover.esiHelp')}
            accept=".xml,text/xml"
            clearable
            multiple
            value={esi}
            onChange={setEsi}
          />
        )}
      </div>
      {OF_SEGMENTS.has(format) && <SegmentAxes axes={axes} onChange={setSegment} />}
      <Checkbox
        label={t('handover.individual')}
        checked={individual}
        onChange={(event) => setIndividual(event.currentTarget.checked)}
      />
      <div className="row end">
        <Button
          variant="filled"
          loading={act.busy}
          disabled={!NAME.test(file) || (rows === 'chosen' && keys.trim() === '')}
          onClick={() => void make()}
        >
          {t('handover.export')}
        </Button>
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {result && <Made result={result} />}
    </>
  )
}

function Made({ result }: { result: HandoverResult }) {
  const t = useT()
  const several = new Set(result.left_out.map((row) => row.drive)).size > 1
  return (
    <div className="note" role="status">
      <p>{t('handover.made', { writes: result.writes, left: result.left_out.length })}</p>
      <div className="row wrap">
        {result.files.map((each) => (
          <Button
            key={each.name}
            onClick={() =>
              offerDownload(each.name, [bytes(each.content)], 'application/octet-stream')
            }
          >
            {t('handover.download', { name: each.name })}
          </Button>
        ))}
      </div>
      {result.files[0] && (
        <p className="mono handover-hash">{t('handover.hash', { sum: result.files[0].sha256 })}</p>
      )}
      {result.notes.length > 0 && (
        <>
          <p className="warn-text">{t('handover.notes')}</p>
          <ul>
            {result.notes.map((text) => (
              <li key={text}>{text}</li>
            ))}
          </ul>
        </>
      )}
      {result.left_out.length > 0 && (
        <details>
          <summary>{t('handover.leftOut')}</summary>
          <ul>
            {result.left_out.map((row) => (
              <li key={`${row.drive} ${row.key}`}>
                {several && `${row.drive} `}
                <span className="mono">{row.key}</span> {row.reason}
              </li>
            ))}
          </ul>
        </details>
      )}
    </div>
  )
}

function bytes(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))
}

async function base64(file: File): Promise<string> {
  const data = new Uint8Array(await file.arrayBuffer())
  let text = ''
  // A call takes only so many arguments.
  for (let at = 0; at < data.length; at += 0x8000) {
    text += String.fromCharCode(...data.subarray(at, at + 0x8000))
  }
  return btoa(text)
}
