import { Button, Checkbox, FileButton, NumberInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { SegmentStation } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { JobNote } from '../../../widgets/jobs/JobNote'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { Said } from '../../../widgets/messages/Said'
import { useAction } from '../../../widgets/requests/useAction'
import { Eeprom } from './Eeprom'

/** One slave: identity, state, clock, ports, alias, firmware. */
export function StationPanel({ url, station }: { url: string; station: SegmentStation }) {
  const t = useT()
  const hex = (value: number) => `0x${value.toString(16).toUpperCase()}`
  const facts: [string, string][] = [
    [t('quality.state'), station.answers ? station.state : t('segment.noAnswer')],
    [t('segment.vendor'), hex(station.vendor_id)],
    [t('segment.product'), `${hex(station.product_code)} / ${hex(station.revision)}`],
    [t('segment.serial'), station.serial === null ? '—' : String(station.serial)],
    [t('segment.alias'), String(station.alias)],
    [t('segment.firmware'), station.firmware || '—'],
    [
      t('segment.clock'),
      !station.distributed_clock
        ? t('segment.noClock')
        : station.reference_clock
          ? t('segment.referenceClock')
          : station.clock_ahead_ns === null
            ? '—'
            : `${station.clock_ahead_ns} ns`,
    ],
  ]
  // Files and consents are of this slave, also where another one is found at its place.
  const { vendor_id, product_code, serial } = station
  const slave = [station.station, station.drive, vendor_id, product_code, serial].join(' ')
  return (
    <div className="station">
      <h3>{`${station.station} · ${station.name}`}</h3>
      {station.error !== '' && (
        <p className="note warn">
          {station.error}
          {station.remedy !== '' && ` — ${station.remedy}`}
        </p>
      )}
      <dl className="counters">
        {facts.map(([name, value]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd className="num">{value}</dd>
          </div>
        ))}
      </dl>
      <div className="scroll-x">
        <table className="ports num">
          <thead>
            <tr>
              <th>{t('segment.port')}</th>
              <th>{t('segment.link')}</th>
              <th>{t('segment.lostLinks')}</th>
              <th>{t('segment.rxErrors')}</th>
              <th>{t('segment.invalidFrames')}</th>
              <th>{t('segment.forwarded')}</th>
            </tr>
          </thead>
          <tbody>
            {station.ports.map((port) => (
              <tr key={port.number} className={port.findings.length > 0 ? 'warn-text' : ''}>
                <td>{port.number}</td>
                <td>{t(port.communicating ? 'segment.linkUp' : 'segment.linkDown')}</td>
                <td>{port.lost_links}</td>
                <td>{port.rx_errors}</td>
                <td>{port.invalid_frames}</td>
                <td>{port.forwarded_errors}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {station.notes.map((note, place) => (
        <p key={note} className="dim">
          <Said message={station.note_messages[place]} words={note} />
        </p>
      ))}
      <Alias key={`alias ${slave}`} url={url} station={station} />
      <Eeprom key={`eeprom ${slave}`} url={url} station={station} />
      {station.foe && station.drive !== null && (
        <Firmware key={`firmware ${slave}`} drive={station.drive} />
      )}
    </div>
  )
}

function Alias({ url, station }: { url: string; station: SegmentStation }) {
  const t = useT()
  const [alias, setAlias] = useState<number | string>(station.alias)
  const [sure, setSure] = useState(false)
  const [written, setWritten] = useState(false)
  const write = useAction()
  const go = () =>
    write.run(async () => {
      const body = { url, station: station.station, alias: Number(alias), confirmed: sure }
      await ask(api.POST('/api/v1/ethercat/alias', { body }))
      setSure(false)
      setWritten(true)
    })
  return (
    <details>
      <summary>{t('segment.writeAlias')}</summary>
      <p className="prose">{t('segment.aliasWarning')}</p>
      <div className="row">
        <NumberInput
          label={t('segment.alias')}
          value={alias}
          min={0}
          max={65535}
          allowDecimal={false}
          onChange={setAlias}
        />
        <Button disabled={!sure || alias === ''} loading={write.busy} onClick={() => void go()}>
          {t('segment.writeAlias')}
        </Button>
      </div>
      <Checkbox
        label={t('segment.aliasSure')}
        checked={sure}
        onChange={(event) => setSure(event.currentTarget.checked)}
      />
      {written && <p className="note good">{t('segment.aliasWritten')}</p>}
      <ProblemNote problem={write.problem} onClose={write.clear} />
    </details>
  )
}

function Firmware({ drive }: { drive: string }) {
  const t = useT()
  const [file, setFile] = useState<File | null>(null)
  const [sure, setSure] = useState(false)
  const [job, setId] = useState<string | null>(null)
  const load = useAction()
  const go = () =>
    load.run(async () => {
      if (!file) return
      const begun = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/firmware', {
          params: { path: { drive_id: drive }, query: { file: file.name, confirmed: sure } },
          body: file as unknown as string,
          bodySerializer: (body) => body,
          headers: { 'Content-Type': 'application/octet-stream' },
        }),
      )
      setJob(begun)
      setId(begun.id)
      setSure(false)
    })
  return (
    <details>
      <summary>{t('segment.loadFirmware')}</summary>
      <p className="note warn">{t('segment.firmwareWarning')}</p>
      <div className="row">
        <FileButton onChange={setFile}>
          {(props) => <Button {...props}>{file ? file.name : t('segment.chooseFirmware')}</Button>}
        </FileButton>
        <Button disabled={!sure || !file} loading={load.busy} onClick={() => void go()}>
          {t('segment.loadFirmware')}
        </Button>
      </div>
      <Checkbox
        label={t('segment.firmwareSure')}
        checked={sure}
        onChange={(event) => setSure(event.currentTarget.checked)}
      />
      <ProblemNote problem={load.problem} onClose={load.clear} />
      <JobNote id={job} />
    </details>
  )
}
