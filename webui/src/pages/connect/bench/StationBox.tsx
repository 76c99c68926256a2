import { Button, NativeSelect, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { BoxInfo } from '../../../api/schema'
import { hasRight, useSession } from '../../../app/people/session'
import { type T, useT } from '../../../i18n'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

type Port = BoxInfo['ports'][number]

/** Name of a station with accounts, and what its network ports are for. */
export function StationBox() {
  const session = useSession()
  return session?.login_required && hasRight('administer') ? <Known /> : null
}

function Known() {
  const t = useT()
  const [info, setInfo] = useState<BoxInfo | null>(null)
  const [changing, setChanging] = useState(false)
  const { run, problem, clear } = useAction()
  useEffect(() => {
    void run(async () => setInfo(await ask(api.GET('/api/v1/box'))))
  }, [run])
  const open = changing || info?.configured === false
  return (
    <Panel
      title={t('box.title')}
      tools={!open && <Button onClick={() => setChanging(true)}>{t('box.change')}</Button>}
    >
      <ProblemNote problem={problem} onClose={clear} />
      {info?.configured && (
        <p>
          {t('box.summary', {
            name: info.name,
            ethercat: info.ethercat || t('box.open'),
            office: info.office || t('box.open'),
          })}
        </p>
      )}
      {info?.configured === false && <p className="note">{t('box.first')}</p>}
      {info && open && (
        <Roles
          info={info}
          onKept={(next) => {
            setInfo(next)
            setChanging(false)
          }}
        />
      )}
    </Panel>
  )
}

function Roles({ info, onKept }: { info: BoxInfo; onKept: (next: BoxInfo) => void }) {
  const t = useT()
  const [name, setName] = useState(info.name)
  const [ethercat, setEthercat] = useState(info.ethercat)
  const [office, setOffice] = useState(
    info.configured ? info.office : (info.ports.find((port) => port.here)?.name ?? ''),
  )
  const action = useAction()
  const keep = () =>
    action.run(async () =>
      onKept(await ask(api.PUT('/api/v1/box', { body: { name, ethercat, office } }))),
    )
  return (
    <form
      className="stack"
      onSubmit={(event) => {
        event.preventDefault()
        void keep()
      }}
    >
      <TextInput
        label={t('box.name')}
        description={t('box.nameHelp')}
        value={name}
        maxLength={63}
        required
        spellCheck={false}
        autoCapitalize="off"
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <PortChoice
        label={t('box.ethercat')}
        ports={info.ports.filter((port) => port.wired)}
        value={ethercat}
        onChange={setEthercat}
      />
      <PortChoice
        label={t('box.office')}
        help={t('box.officeHelp')}
        ports={info.ports}
        value={office}
        onChange={setOffice}
      />
      <ProblemNote problem={action.problem} onClose={action.clear} />
      <Button type="submit" loading={action.busy}>
        {t('box.keep')}
      </Button>
    </form>
  )
}

function PortChoice({
  label,
  help,
  ports,
  value,
  onChange,
}: {
  label: string
  help?: string
  ports: Port[]
  value: string
  onChange: (value: string) => void
}) {
  const t = useT()
  return (
    <NativeSelect
      label={label}
      description={help}
      value={value}
      data={[
        { value: '', label: t('box.open') },
        ...ports.map((port) => ({ value: port.name, label: described(t, port) })),
      ]}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  )
}

function described(t: T, port: Port): string {
  const notes = [
    ...port.addresses,
    ...(port.here ? [t('box.here')] : []),
    ...(port.up ? [] : [t('box.down')]),
  ]
  return notes.length === 0 ? port.name : `${port.name} (${notes.join(', ')})`
}
