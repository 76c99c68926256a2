import { Button, PasswordInput, TextInput } from '@mantine/core'
import { type ReactNode, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Session } from '../../api/schema'
import { useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { keep } from './session'

/** The address of an invitation. */
export const GUEST = /^#\/guest\/([\w-]+)$/

/** A form that ends in a session. */
function Entrance({
  title,
  text,
  send,
  enter,
  blocked = false,
  children,
}: {
  title: string
  text?: string
  send: string
  enter: () => Promise<Session>
  blocked?: boolean
  children: ReactNode
}) {
  const act = useAction()
  const submit = () =>
    act.run(async () => {
      const session = await enter()
      if (GUEST.test(window.location.hash)) window.location.hash = '#/connect'
      keep(session)
    })
  return (
    <Panel title={title}>
      {text && <p>{text}</p>}
      <form
        className="stack"
        onSubmit={(event) => {
          event.preventDefault()
          if (!blocked) void submit()
        }}
      >
        {children}
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <Button type="submit" loading={act.busy} disabled={blocked}>
          {send}
        </Button>
      </form>
      <Authority />
    </Panel>
  )
}

interface Field {
  value: string
  onChange: (value: string) => void
}

function NameField({ value, onChange }: Field) {
  const t = useT()
  return (
    <TextInput
      label={t('login.name')}
      value={value}
      autoComplete="username"
      maxLength={60}
      required
      data-autofocus
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  )
}

/** A password that exists already. */
export function PasswordField({
  label,
  error,
  again = false,
  value,
  onChange,
}: Field & { label: string; error?: string | undefined; again?: boolean }) {
  return (
    <PasswordInput
      label={label}
      value={value}
      autoComplete={again ? 'new-password' : 'current-password'}
      maxLength={200}
      required
      error={error}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  )
}

export function NewPassword({ value, onChange }: Field) {
  const t = useT()
  return (
    <PasswordInput
      label={t('login.newPassword')}
      description={t('login.passwordRule')}
      value={value}
      autoComplete="new-password"
      minLength={10}
      maxLength={200}
      required
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  )
}

function CodeField({ help, value, onChange }: Field & { help: string }) {
  const t = useT()
  return (
    <TextInput
      label={t('login.code')}
      description={help}
      value={value}
      autoComplete="off"
      className="mono-input"
      maxLength={40}
      required
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  )
}

const CERTIFICATE_FILE = 'servodeck.crt'

/** For a browser that came by HTTPS: the station's authority, to be trusted once. */
function Authority() {
  const t = useT()
  if (window.location.protocol !== 'https:') return null
  return (
    <details>
      <summary>{t('login.certificate')}</summary>
      <p className="dim">{t('login.certificateHelp')}</p>
      <a href="./api/v1/certificate" download>
        {CERTIFICATE_FILE}
      </a>
    </details>
  )
}

export function LogIn() {
  const t = useT()
  const [name, setName] = useState('')
  const [password, setPassword] = useState('')
  return (
    <Entrance
      title={t('login.logIn')}
      send={t('login.logIn')}
      enter={() => ask(api.POST('/api/v1/session', { body: { name, password } }))}
    >
      <NameField value={name} onChange={setName} />
      <PasswordField label={t('login.password')} value={password} onChange={setPassword} />
    </Entrance>
  )
}

/** The first administrator, with the code that the terminal shows. */
export function SetUp() {
  const t = useT()
  const [code, setCode] = useState('')
  const [name, setName] = useState('')
  const [password, setPassword] = useState('')
  const [again, setAgain] = useState('')
  const differs = again !== '' && again !== password
  return (
    <Entrance
      title={t('login.setUp')}
      text={t('login.setUpText')}
      send={t('login.setUpDo')}
      blocked={differs}
      enter={async () => {
        const session = await ask(api.POST('/api/v1/setup', { body: { code, name, password } }))
        // There the station is named, and its ports get their roles.
        window.location.hash = '#/connect'
        return session
      }}
    >
      <CodeField help={t('login.codeText')} value={code} onChange={setCode} />
      <NameField value={name} onChange={setName} />
      <NewPassword value={password} onChange={setPassword} />
      <PasswordField
        label={t('login.again')}
        again
        value={again}
        onChange={setAgain}
        error={differs ? t('login.differs') : undefined}
      />
    </Entrance>
  )
}

export function Join({ link }: { link: string }) {
  const t = useT()
  const [code, setCode] = useState('')
  return (
    <Entrance
      title={t('login.join')}
      text={t('login.joinText')}
      send={t('login.joinDo')}
      enter={() => ask(api.POST('/api/v1/guests', { body: { link, code } }))}
    >
      <CodeField help={t('login.joinCode')} value={code} onChange={setCode} />
    </Entrance>
  )
}
