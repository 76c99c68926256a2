import '../../widgets/layout/functions.css'
import { Button } from '@mantine/core'
import { api, ask } from '../../api/client'
import type { FaultHistoryInfo, PastFaultInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { dateTime, shown } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterText } from '../../widgets/parameters/ParameterText'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProcedureButton } from '../../widgets/faults/Procedures'
import { useRows } from '../../widgets/profile-text/rows'
import { useSay } from '../../widgets/profile-text/texts'
import { Said } from '../../widgets/messages/Said'
import { useAction } from '../../widgets/requests/useAction'
import { useFetched } from '../../widgets/drive/useFunctions'

/** What the drive itself remembers, with the values that it froze. */
export function History({ drive }: { drive: string }) {
  const t = useT()
  const { data, problem, read, setData } = useFetched<FaultHistoryInfo>(
    () =>
      ask(
        api.GET('/api/v1/drives/{drive_id}/fault-history', {
          params: { path: { drive_id: drive } },
        }),
      ),
    [drive],
  )
  const act = useAction()
  const readNow = () =>
    act.run(async () =>
      setData(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/fault-history/read', {
            params: { path: { drive_id: drive } },
          }),
        ),
      ),
    )
  if (!data) return <ProblemNote problem={problem} />
  const readable = data.kind === 'slots' || data.kind === 'selected'
  return (
    <Panel
      title={t('history.title')}
      tools={
        <>
          {readable && (
            <Button
              loading={act.busy}
              onClick={() => void (data.kind === 'slots' ? act.run(read) : readNow())}
            >
              {t('history.read')}
            </Button>
          )}
          <ProcedureButton
            drive={drive}
            name="clear_history"
            label={t('faults.clearHistory')}
            onEnd={() => void (data.kind === 'selected' ? readNow() : read())}
          />
        </>
      }
    >
      <ProblemNote problem={act.problem ?? problem} onClose={act.clear} />
      {data.kind === 'unknown' && <p className="dim">{t('history.unknown')}</p>}
      {data.size > 0 && (
        <p className="dim">
          {t('history.count', { size: data.size })}{' '}
          {!data.newest_first && t('history.orderUnknown')}{' '}
          {data.kind === 'selected' && data.read_at === null && t('history.notRead')}
          {data.read_at && dateTime(data.read_at)}
        </p>
      )}
      {data.notes && (
        <p className="prose">
          <ProfileText drive={drive} text={data.notes} />
        </p>
      )}
      {data.read_at && data.entries.length === 0 && (
        <p className="good-text">{t('history.empty')}</p>
      )}
      <ul className="past-faults">
        {data.entries.map((entry) => (
          <Past key={entry.name} drive={drive} entry={entry} />
        ))}
      </ul>
      {data.source && <p className="dim">{t('source', { source: data.source })}</p>}
    </Panel>
  )
}

function Past({ drive, entry }: { drive: string; entry: PastFaultInfo }) {
  const t = useT()
  const say = useSay(drive)
  const rows = useRows(drive) ?? []
  const values = entry.values.flatMap((value) => {
    const row = rows.find((each) => each.key === value.key)
    return row ? [{ row, value }] : []
  })
  const name = entry.name_message ? (
    <Said message={entry.name_message} words={entry.name} />
  ) : (
    say(entry.name)
  )
  if (entry.error) {
    return (
      <li>
        <strong>{name}</strong>{' '}
        <span className="warn-text">
          <Said message={entry.error_message} words={entry.error} />
        </span>
      </li>
    )
  }
  return (
    <li className={entry.kind ?? ''}>
      <h3>
        <small className="dim">{name}</small> <span className="mono">{entry.code}</span>{' '}
        {entry.known ? <ProfileText drive={drive} text={entry.title} /> : t('history.notInProfile')}
      </h3>
      {values.length > 0 && (
        <details>
          <summary>{t('history.values')}</summary>
          <dl className="facts">
            {values.map(({ row, value }) => (
              <div key={row.key} className="pair">
                <dt>{row.name}</dt>
                <dd className="num">
                  {value.error ? (
                    <Said message={value.error_message} words={value.error} />
                  ) : (
                    `${shown(row, value.value, value.raw)} ${row.unit}`
                  )}
                </dd>
              </div>
            ))}
          </dl>
        </details>
      )}
      {(entry.causes.length > 0 || entry.remedies.length > 0) && (
        <details>
          <summary>{t('history.why')}</summary>
          <h4>{t('faults.causes')}</h4>
          <ul>
            {entry.causes.map((text) => (
              <li key={text}>
                <ParameterText drive={drive} text={text} />
              </li>
            ))}
          </ul>
          <h4>{t('faults.remedies')}</h4>
          <ul>
            {entry.remedies.map((text) => (
              <li key={text}>
                <ParameterText drive={drive} text={text} />
              </li>
            ))}
          </ul>
        </details>
      )}
    </li>
  )
}
