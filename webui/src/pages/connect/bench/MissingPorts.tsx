import { Button, NumberInput, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DriveSummary, MissingPort } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { ProfileText } from '../../../widgets/profile-text/ProfileText'
import { useSay } from '../../../widgets/profile-text/texts'
import { useAction } from '../../../widgets/requests/useAction'

const NAMES = { ethercat: 'EtherCAT', canopen: 'CANopen', modbus: 'Modbus', mlink: 'MLink' }
const GROUPS_SHOWN = 4

/** Ports that the drive has and that are not connected: what only they reach, and how to. */
export function MissingPorts({ drive }: { drive: DriveSummary }) {
  const [missing, setMissing] = useState<MissingPort[]>([])
  const connected = drive.ports.map((port) => port.kind).join()
  useEffect(() => {
    const path = { drive_id: drive.id }
    ask(api.GET('/api/v1/drives/{drive_id}/missing-ports', { params: { path } })).then(
      setMissing,
      () => setMissing([]),
    )
  }, [drive.id, connected])
  return missing.map((port) => <Missing key={port.kind} drive={drive} port={port} />)
}

function Missing({ drive, port }: { drive: DriveSummary; port: MissingPort }) {
  const t = useT()
  const kind = NAMES[port.kind]
  const [url, setUrl] = useState('')
  const [station, setStation] = useState<number | string>(drive.ports[0]?.station ?? 1)
  const connect = useAction()
  const place = `${url.trim()} ${station}`
  const [tried, setTried] = useState('')
  const retype = (change: () => void) => {
    change()
    connect.clear()
  }
  const add = (accept_difference: boolean) => {
    setTried(place)
    return connect.run(() =>
      ask(
        api.POST('/api/v1/drives/{drive_id}/ports', {
          params: { path: { drive_id: drive.id } },
          body: { url: url.trim(), station: Number(station), accept_difference },
        }),
      ),
    )
  }
  // Only a comparison of settings names a parameter; what it found is of the port that was tried.
  const differs = connect.problem?.status === 409 && connect.problem.parameter && tried === place
  const say = useSay(drive.id)
  const groups =
    port.groups.slice(0, GROUPS_SHOWN).map(say).join(', ') +
    (port.groups.length > GROUPS_SHOWN ? ', …' : '')
  return (
    <details>
      <summary className={port.parameters > 0 ? 'warn-text' : ''}>
        {port.parameters > 0
          ? t('port.missing', { kind, count: port.parameters, groups })
          : t('port.missingNothing', { kind })}
      </summary>
      {port.wiring && (
        <p className="prose">
          <ProfileText drive={drive.id} text={port.wiring} />
        </p>
      )}
      <div className="row">
        <TextInput
          className="grow mono-input"
          label={t('port.url')}
          placeholder={`${port.kind}://…`}
          value={url}
          spellCheck={false}
          autoCapitalize="off"
          onChange={(event) => {
            const { value } = event.currentTarget
            retype(() => setUrl(value))
          }}
        />
        <NumberInput
          label={t('port.station')}
          value={station}
          min={0}
          max={65535}
          allowDecimal={false}
          onChange={(value) => retype(() => setStation(value))}
        />
        <Button
          variant="filled"
          disabled={url.trim() === '' || station === ''}
          loading={connect.busy}
          onClick={() => void add(false)}
        >
          {t('port.connect', { kind })}
        </Button>
      </div>
      <ProblemNote problem={connect.problem} onClose={connect.clear} />
      {differs && (
        <Button loading={connect.busy} onClick={() => void add(true)}>
          {t('port.accept')}
        </Button>
      )}
    </details>
  )
}
