import { Button, Checkbox, SegmentedControl } from '@mantine/core'
import { useEffect, useRef, useState } from 'react'
import { api, ask, problemOf } from '../../api/client'
import type { ForcingInfo, MessageInfo } from '../../api/schema'
import { plainResult } from '../../api/results'
import { useSay as useMessages, useT } from '../../i18n'
import { useJob } from '../../live/store'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useSay } from '../../widgets/profile-text/texts'
import { useAction } from '../../widgets/requests/useAction'

/** The server lets go five seconds after the last sign of life. */
const ALIVE_MS = 1000

/**
 * Overruling terminals: only for a while, only by the page that began it, and restored when it
 * ends, however it ends.
 */
export function ForcingPanel({
  drive,
  forcing,
  onChanged,
}: {
  drive: string
  forcing: ForcingInfo
  onChanged: () => void
}) {
  const t = useT()
  const say = useSay(drive)
  const speak = useMessages()
  const [agreed, setAgreed] = useState(false)
  const [mine, setMine] = useState<ForcingInfo | null>(null)
  // Asked to end, by this page: no further sign of life, whether or not the server confirms it.
  const [ending, setEnding] = useState<'asked' | 'unconfirmed' | 'confirmed' | null>(null)
  const act = useAction()
  const job = useJob(mine?.job ?? forcing.job ?? null)
  const path = { drive_id: drive, name: forcing.name }
  const plain = plainResult(job?.result) as { reason?: string; reason_message?: MessageInfo | null }
  const over = mine !== null && job !== null && job.state !== 'running'
  useEffect(() => {
    if (!mine || over || ending !== null) return
    const timer = setInterval(() => {
      // A page that nobody looks at must not hold terminals.
      if (document.hidden) return
      ask(
        api.PUT('/api/v1/drives/{drive_id}/io/forcing/{name}', {
          params: { path },
          body: { values: {} },
        }),
      ).catch((error: unknown) => act.setProblem(problemOf(error)))
    }, ALIVE_MS)
    return () => clearInterval(timer)
  }, [mine !== null, over, ending !== null, drive, forcing.name])
  const leave = useRef(() => {})
  leave.current = () => {
    // Nobody is there to read what comes of it: without a sign of life the server ends it anyway.
    if (mine && !over && ending !== 'confirmed') {
      void api
        .DELETE('/api/v1/drives/{drive_id}/io/forcing/{name}', { params: { path } })
        .catch(() => {})
    }
  }
  useEffect(() => () => leave.current(), [drive, forcing.name])
  useEffect(() => {
    if (over) onChanged()
  }, [over])
  const end = async () => {
    setEnding('asked')
    const done = await act.run(() =>
      ask(api.DELETE('/api/v1/drives/{drive_id}/io/forcing/{name}', { params: { path } })),
    )
    setEnding(done ? 'confirmed' : 'unconfirmed')
    if (done) onChanged()
  }
  const begin = () =>
    act.run(async () => {
      setEnding(null)
      setMine(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/io/forcing/{name}', {
            params: { path },
            body: { confirmed: agreed },
          }),
        ),
      )
      setAgreed(false)
    })
  const set = (terminal: string, value: boolean | null) =>
    act.run(async () =>
      setMine(
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/io/forcing/{name}', {
            params: { path },
            body: { values: { [terminal]: value } },
          }),
        ),
      ),
    )
  const holding = mine !== null && !over && ending === null
  const unconfirmed = mine !== null && !over && (ending === 'asked' || ending === 'unconfirmed')
  return (
    <Panel title={say(forcing.title)}>
      <p className="prose">
        <ProfileText drive={drive} text={forcing.help} />
      </p>
      <p className="note warn">
        <ProfileText drive={drive} text={forcing.warning} />
      </p>
      {forcing.notes && (
        <p className="dim">
          <ProfileText drive={drive} text={forcing.notes} />
        </p>
      )}
      {over && job?.problem && <ProblemNote problem={job.problem} onClose={() => setMine(null)} />}
      {over && !job?.problem && (
        <p className="note info" role="status">
          {speak.message(plain.reason_message, plain.reason)}
        </p>
      )}
      {unconfirmed ? (
        <>
          {ending === 'unconfirmed' && (
            <p className="note fault" role="alert">
              {t('io.force.notEnded')}
            </p>
          )}
          <Button variant="filled" loading={act.busy} onClick={() => void end()}>
            {t('io.force.end')}
          </Button>
        </>
      ) : !holding && forcing.running && !mine ? (
        <p className="note warn">{t('io.force.other')}</p>
      ) : (
        !holding && (
          <>
            <Checkbox
              label={t('io.force.agree')}
              checked={agreed}
              onChange={(event) => setAgreed(event.currentTarget.checked)}
            />
            <Button disabled={!agreed} loading={act.busy} onClick={() => void begin()}>
              {t('io.force.begin')}
            </Button>
          </>
        )
      )}
      {holding && (
        <>
          <p className="note fault" role="status">
            {t('io.force.running')}
          </p>
          <ul className="forced">
            {forcing.terminals.map((terminal) => {
              const value = mine.values[terminal]
              return (
                <li key={terminal}>
                  <strong>{terminal}</strong>
                  <SegmentedControl
                    aria-label={t('io.force.value', { name: terminal })}
                    disabled={act.busy}
                    value={value === undefined ? 'own' : value ? 'on' : 'off'}
                    onChange={(next) => void set(terminal, next === 'own' ? null : next === 'on')}
                    data={[
                      { value: 'own', label: t('io.force.own') },
                      { value: 'on', label: t('io.force.on') },
                      ...(forcing.two_way ? [{ value: 'off', label: t('io.force.off') }] : []),
                    ]}
                  />
                </li>
              )
            })}
          </ul>
          <Button variant="filled" onClick={() => void end()}>
            {t('io.force.end')}
          </Button>
        </>
      )}
      <ProblemNote problem={act.problem} onClose={act.clear} />
      <p className="dim">{t('source', { source: forcing.source })}</p>
    </Panel>
  )
}
