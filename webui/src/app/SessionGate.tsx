import { Button, PasswordInput, TextInput } from '@mantine/core'
import { type SyntheticEvent, type ReactNode, useEffect, useState } from 'react'
import { api, ask } from '../api/client'
import type { Session } from '../api/schema'
import { useT } from '../i18n'
import * as live from '../live/live'
import { Panel } from '../widgets/Panel'
import { ProblemNote } from '../widgets/ProblemNote'
import { useAction } from '../widgets/useAction'
import { Preferences } from './Preferences'
import { StopButton } from './StopButton'
import { askSession, keep, mayHaveStop, useSession } from './session'

const RETRY_MS = 2000
const GUEST = /^#\/guest\/([\w-]+)$/

/** The page behind it is for somebody whom the server knows. */
export function SessionGate({ children }: { children: ReactNode }) {
  const session = useSession()
  const t = useT()
  const known = session?.person != null
  useEffect(() => {
    if (session !== null) return
    const ask = () => void askSession().catch(() => {})
    ask()
    const timer = setInterval(ask, RETRY_MS)
    return () => clearInterval(timer)
  }, [session])
  useEffect(() => {
    if (known) live.start()
  }, [known])
  if (session === null) {
    return (
      <main className="door">
        <p role="status">{t('lost.opening')}</p>
      </main>
    )
  }
  if (known) return <>{children}</>
  const link = GUEST.exec(window.location.hash)?.[1]
  return (
    <main className="door">
      {mayHaveStop() && <StopButton />}
      <div className="door-head">
        <h1>servodeck</h1>
        <Preferences />
      </div>
      {link ? <Join link={link} /> : session.setup_required ? <SetUp /> : <LogIn />}
    </main>
  )
}

function entered(session: Session) {
  if (GUEST.test(window.location.hash)) window.location.hash = '#/connect'
  keep(session)
}

function LogIn() {
  const t = useT()
  const act = useAction()
  const [name, setName] = useState('')
  const [password, setPassword] = useState('')
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(async () => {
      entered(await ask(api.POST('/api/v1/session', { body: { name, password } })))
    })
  }
  return (
    <Panel title={t('door.logIn')}>
      <form onSubmit={submit} className="stack">
        <TextInput
          label={t('door.name')}
          value={name}
          autoComplete="username"
          maxLength={60}
          required
          data-autofocus
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <PasswordInput
          label={t('door.password')}
          value={password}
          autoComplete="current-password"
          maxLength={200}
          required
          onChange={(event) => setPassword(event.currentTarget.value)}
        />
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <Button type="submit" loading={act.busy}>
          {t('door.logIn')}
        </Button>
      </form>
    </Panel>
  )
}

function SetUp() {
  const t = useT()
  const act = useAction()
  const [code, setCode] = useState('')
  const [name, setName] = useState('')
  const [password, setPassword] = useState('')
  const [again, setAgain] = useState('')
  const differs = again !== '' && again !== password
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    if (password !== again) return
    void act.run(async () => {
      entered(await ask(api.POST('/api/v1/setup', { body: { code, name, password } })))
    })
  }
  return (
    <Panel title={t('door.setUp')}>
      <p>{t('door.setUpText')}</p>
      <form onSubmit={submit} className="stack">
        <TextInput
          label={t('door.code')}
          description={t('door.codeText')}
          value={code}
          autoComplete="off"
          className="mono-input"
          maxLength={40}
          required
          onChange={(event) => setCode(event.currentTarget.value)}
        />
        <TextInput
          label={t('door.name')}
          value={name}
          autoComplete="username"
          maxLength={60}
          required
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <NewPassword value={password} onChange={setPassword} />
        <PasswordInput
          label={t('door.again')}
          value={again}
          autoComplete="new-password"
          maxLength={200}
          required
          error={differs ? t('door.differs') : undefined}
          onChange={(event) => setAgain(event.currentTarget.value)}
        />
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <Button type="submit" loading={act.busy} disabled={differs}>
          {t('door.setUpDo')}
        </Button>
      </form>
    </Panel>
  )
}

export function NewPassword(props: { value: string; onChange: (value: string) => void }) {
  const t = useT()
  return (
    <PasswordInput
      label={t('door.newPassword')}
      description={t('door.passwordRule')}
      value={props.value}
      autoComplete="new-password"
      minLength={10}
      maxLength={200}
      required
      onChange={(event) => props.onChange(event.currentTarget.value)}
    />
  )
}

function Join({ link }: { link: string }) {
  const t = useT()
  const act = useAction()
  const [code, setCode] = useState('')
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(async () => {
      entered(await ask(api.POST('/api/v1/guests', { body: { link, code } })))
    })
  }
  return (
    <Panel title={t('door.join')}>
      <p>{t('door.joinText')}</p>
      <form onSubmit={submit} className="stack">
        <TextInput
          label={t('door.code')}
          description={t('door.joinCode')}
          value={code}
          autoComplete="off"
          className="mono-input"
          maxLength={40}
          required
          onChange={(event) => setCode(event.currentTarget.value)}
        />
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <Button type="submit" loading={act.busy}>
          {t('door.joinDo')}
        </Button>
      </form>
    </Panel>
  )
}
