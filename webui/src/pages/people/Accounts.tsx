import { Button, NativeSelect, TextInput } from '@mantine/core'
import { type SyntheticEvent, useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { AccountInfo, Role } from '../../api/schema'
import { NewPassword } from '../../app/people/LogInForms'
import { useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'

const ROLES: Role[] = ['viewer', 'operator', 'administrator']

/** Who may log in; for administrators. */
export function Accounts() {
  const t = useT()
  const [accounts, setAccounts] = useState<AccountInfo[]>([])
  const act = useAction()
  const refresh = useCallback(async () => setAccounts(await ask(api.GET('/api/v1/accounts'))), [])
  useEffect(() => void act.run(refresh), [])
  const change = (account_id: number, role: Role) =>
    act.run(async () => {
      const params = { path: { account_id } }
      await ask(api.PATCH('/api/v1/accounts/{account_id}', { params, body: { role } }))
      await refresh()
    })
  return (
    <Panel title={t('accounts.title')}>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {accounts.map((each) => (
        <Account key={each.id} account={each} onRole={change} onChanged={refresh} />
      ))}
      <AddAccount onMade={() => void act.run(refresh)} />
    </Panel>
  )
}

function Account(props: {
  account: AccountInfo
  onRole: (id: number, role: Role) => unknown
  onChanged: () => Promise<void>
}) {
  const t = useT()
  const { account } = props
  const act = useAction()
  const [sure, setSure] = useState(false)
  const [setting, setSetting] = useState(false)
  const [password, setPassword] = useState('')
  const params = { path: { account_id: account.id } }
  const remove = () =>
    act.run(async () => {
      await ask(api.DELETE('/api/v1/accounts/{account_id}', { params }))
      await props.onChanged()
    })
  const set = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(async () => {
      await ask(api.PATCH('/api/v1/accounts/{account_id}', { params, body: { password } }))
      setSetting(false)
      setPassword('')
      await props.onChanged()
    })
  }
  return (
    <article className="set wrap">
      <div className="grow">
        <strong>{account.name}</strong>{' '}
        {account.me && <span className="dim">{t('people.me')}</span>}
        <p className="dim">
          {t('accounts.counts', { sessions: account.sessions, tokens: account.tokens })}
        </p>
        {setting && (
          <form onSubmit={set} className="stack">
            <NewPassword value={password} onChange={setPassword} />
            <Button type="submit" loading={act.busy}>
              {t('accounts.setPassword')}
            </Button>
          </form>
        )}
        <ProblemNote problem={act.problem} onClose={act.clear} />
      </div>
      <NativeSelect
        aria-label={t('accounts.role')}
        value={account.role}
        onChange={(event) => props.onRole(account.id, event.currentTarget.value as Role)}
        data={ROLES.map((each) => ({ value: each, label: t(`role.${each}`) }))}
      />
      {!setting && (
        <Button variant="default" onClick={() => setSetting(true)}>
          {t('accounts.setPassword')}
        </Button>
      )}
      <Button
        variant={sure ? 'filled' : 'default'}
        color="red"
        onClick={() => (sure ? void remove() : setSure(true))}
        onBlur={() => setSure(false)}
      >
        {t(sure ? 'accounts.really' : 'accounts.remove')}
      </Button>
    </article>
  )
}

function AddAccount({ onMade }: { onMade: () => void }) {
  const t = useT()
  const act = useAction()
  const [name, setName] = useState('')
  const [role, setRole] = useState<Role>('operator')
  const [password, setPassword] = useState('')
  const submit = (event: SyntheticEvent) => {
    event.preventDefault()
    void act.run(async () => {
      await ask(api.POST('/api/v1/accounts', { body: { name, role, password } }))
      setName('')
      setPassword('')
      onMade()
    })
  }
  return (
    <form onSubmit={submit} className="fields">
      <TextInput
        label={t('login.name')}
        value={name}
        maxLength={60}
        autoComplete="off"
        required
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <NativeSelect
        label={t('accounts.role')}
        value={role}
        onChange={(event) => setRole(event.currentTarget.value as Role)}
        data={ROLES.map((each) => ({ value: each, label: t(`role.${each}`) }))}
      />
      <NewPassword value={password} onChange={setPassword} />
      <Button type="submit" loading={act.busy}>
        {t('accounts.add')}
      </Button>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </form>
  )
}
