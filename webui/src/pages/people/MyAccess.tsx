import { Button, NumberInput, TextInput } from '@mantine/core'
import { type SyntheticEvent, useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { MadeToken, Right, SessionInfo, TokenInfo } from '../../api/schema'
import { NewPassword, PasswordField } from '../../app/people/LogInForms'
import { useSession } from '../../app/people/session'
import { useT } from '../../i18n'
import { dateTime } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { Rights } from './Invitations'
import { rightsInWords } from './rights'

/** The own password, log-ins and tokens; an administrator sees everybody's log-ins and tokens. */
export function MyAccess() {
  const t = useT()
  const [sessions, setSessions] = useState<SessionInfo[]>([])
  const [tokens, setTokens] = useState<TokenInfo[]>([])
  const act = useAction()
  const refresh = useCallback(async () => {
    setSessions(await ask(api.GET('/api/v1/sessions')))
    setTokens(await ask(api.GET('/api/v1/tokens')))
  }, [])
  useEffect(() => void act.run(refresh), [])
  const end = (session_id: string) =>
    act.run(async () => {
      const params = { path: { session_id } }
      await ask(api.DELETE('/api/v1/sessions/{session_id}', { params }))
      await refresh()
    })
  const revoke = (token_id: string) =>
    act.run(async () => {
      await ask(api.DELETE('/api/v1/tokens/{token_id}', { params: { path: { token_id } } }))
      await refresh()
    })
  return (
    <div className="columns">
      <Panel title={t('access.title')}>
        <ChangePassword />
        <h3>{t('access.sessions')}</h3>
        <ProblemNote problem={act.problem} onClose={act.clear} />
        {sessions.map((each) => (
          <article key={each.id} className="set">
            <div className="grow">
              <strong>{each.person}</strong>{' '}
              {each.me && <span className="dim">{t('people.me')}</span>}
              <p className="dim notes">
                {each.client} · {t('access.used', { time: dateTime(each.used) })}
              </p>
            </div>
            {!each.me && (
              <Button variant="default" onClick={() => void end(each.id)}>
                {t('access.end')}
              </Button>
            )}
          </article>
        ))}
      </Panel>
      <Panel title={t('access.tokens')}>
        <MakeToken onMade={() => void act.run(refresh)} />
        {tokens.map((each) => (
          <article key={each.id} className="set">
            <div className="grow">
              <strong>{each.name}</strong>
              <p className="dim">
                {each.person} · {rightsInWords(t, each.scopes)} ·{' '}
                {t('support.until', { time: dateTime(each.expires) })}
              </p>
            </div>
            <Button variant="default" onClick={() => void revoke(each.id)}>
              {t('access.revoke')}
            </Button>
          </article>
        ))}
      </Panel>
    </div>
  )
}

function ChangePassword() {
  const t = useT()
  const act = useAction()
  const [present, setPresent] = useState('')
  const [password, setPassword] = useState('')
  const [done, setDone] = useState(false)
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    setDone(false)
    void act.run(async () => {
      await ask(api.PUT('/api/v1/session/password', { body: { present, password } }))
      setPresent('')
      setPassword('')
      setDone(true)
    })
  }
  return (
    <form onSubmit={submit} className="stack">
      <PasswordField label={t('access.present')} value={present} onChange={setPresent} />
      <NewPassword value={password} onChange={setPassword} />
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {done && <p className="good-text">{t('access.changed')}</p>}
      <Button type="submit" variant="default" loading={act.busy}>
        {t('access.change')}
      </Button>
    </form>
  )
}

function MakeToken({ onMade }: { onMade: () => void }) {
  const t = useT()
  const session = useSession()
  const act = useAction()
  const [name, setName] = useState('')
  const [days, setDays] = useState(30)
  const [scopes, setScopes] = useState<Right[]>(['look'])
  const [made, setMade] = useState<MadeToken | null>(null)
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(async () => {
      setMade(await ask(api.POST('/api/v1/tokens', { body: { name, days, scopes } })))
      setName('')
      onMade()
    })
  }
  return (
    <form onSubmit={submit} className="stack">
      <p className="prose">{t('access.tokenText')}</p>
      <TextInput
        label={t('access.purpose')}
        value={name}
        maxLength={60}
        required
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <NumberInput
        label={t('access.days')}
        value={days}
        min={1}
        max={366}
        onChange={(value) => setDays(Number(value) || 1)}
      />
      <Rights
        label={t('access.scopes')}
        offered={session?.rights ?? []}
        chosen={scopes}
        onChange={setScopes}
      />
      <ProblemNote problem={act.problem} onClose={act.clear} />
      <Button
        type="submit"
        variant="default"
        loading={act.busy}
        disabled={scopes.length === 0 || name.trim() === ''}
      >
        {t('access.makeToken')}
      </Button>
      {made && (
        <div className="note info">
          <p>{t('access.secret')}</p>
          <p className="mono">{made.secret}</p>
        </div>
      )}
    </form>
  )
}
