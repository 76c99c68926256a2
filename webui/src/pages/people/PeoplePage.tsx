import './people.css'
import { hasRight, useSession } from '../../app/people/session'
import { useT } from '../../i18n'
import { usePeople } from '../../live/people'
import { useDrives } from '../../live/store'
import { clock } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { Accounts } from './Accounts'
import { ChatPanel } from './ChatPanel'
import { Invitations } from './Invitations'
import { MyAccess } from './MyAccess'

const COMMAND = 'servodeck serve --accounts'

/** Who is here, who controls what, who may come, and from where they may help. */
export function PeoplePage() {
  const t = useT()
  const session = useSession()
  const alone = session?.login_required === false
  return (
    <div className="page">
      <h1>{t('page.people')}</h1>
      {alone && (
        <div className="note info">
          <p>{t('people.alone')}</p>
          <p className="mono">{COMMAND}</p>
        </div>
      )}
      <div className="columns">
        <Here />
        <ChatPanel />
      </div>
      {!alone && hasRight('invite') && <Invitations />}
      {!alone && !session?.guest && <MyAccess />}
      {!alone && hasRight('administer') && <Accounts />}
    </div>
  )
}

function Here() {
  const t = useT()
  const here = usePeople()
  const drives = useDrives() ?? []
  const name = (id: string) => drives.find((each) => each.id === id)?.name ?? id
  return (
    <Panel title={t('people.here')}>
      <ul className="plain-list">
        {here?.people.map((each) => (
          <li key={each.connection} className="person">
            <span className="grow">
              <strong>{each.person}</strong>{' '}
              {each.me && <span className="dim">{t('people.me')}</span>}
              <small className="dim">
                {t(`role.${each.role}`)} · {t('people.since', { time: clock(each.since) })}
                {each.page && !each.me && (
                  <>
                    {' · '}
                    <a href={`#${each.page}`}>{t('people.sameView')}</a>
                  </>
                )}
              </small>
            </span>
            {each.holds.map((drive) => (
              <span key={drive} className="badge warn">
                <span>{t('people.controls', { axis: name(drive) })}</span>
              </span>
            ))}
          </li>
        ))}
      </ul>
    </Panel>
  )
}
