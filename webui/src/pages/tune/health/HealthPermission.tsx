import { Button, Checkbox, TextInput } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { HealthPermissionInfo, JobInfo } from '../../../api/schema'
import { hasRight } from '../../../app/people/session'
import { useSay, useT } from '../../../i18n'
import type { Key } from '../../../i18n'
import { useLink } from '../../../live/store'
import { dateTime } from '../../../widgets/numbers/format'
import { useJobEnd } from '../../../widgets/jobs/JobNote'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

/** Monday first, as the schedule counts them. */
const DAYS = [0, 1, 2, 3, 4, 5, 6]
const DAY_MS = 86_400_000
/** Attempts that the table shows. */
const SHOWN = 10

/** Runs without a person: who permits them, until when, on which days, and what became of them. */
export function HealthPermission({ drive, job }: { drive: string; job: JobInfo | null }) {
  const t = useT()
  const { open } = useLink()
  const [known, setKnown] = useState<HealthPermissionInfo | null>(null)
  const act = useAction()
  const params = { path: { drive_id: drive } }
  const refresh = useCallback(async () => {
    const path = { drive_id: drive }
    const found = await ask(
      api.GET('/api/v1/drives/{drive_id}/health/permission', { params: { path } }),
    )
    setKnown(found ?? null)
  }, [drive])
  useEffect(() => {
    if (open) void act.run(refresh)
  }, [open, refresh])
  useJobEnd(job?.id ?? null, () => void act.run(refresh))
  const withdraw = () =>
    act.run(async () => {
      await ask(api.DELETE('/api/v1/drives/{drive_id}/health/permission', { params }))
      await refresh()
    })
  return (
    <details>
      <summary>{t('health.unattended')}</summary>
      <p className="dim">{t('health.unattendedHelp')}</p>
      {known ? (
        <Given known={known} busy={act.busy} onWithdraw={() => void withdraw()} />
      ) : (
        <p className="dim">{t('health.nobodyPermits')}</p>
      )}
      {hasRight('motion') && <Permit drive={drive} onGiven={setKnown} />}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </details>
  )
}

function Given({
  known,
  busy,
  onWithdraw,
}: {
  known: HealthPermissionInfo
  busy: boolean
  onWithdraw: () => void
}) {
  const t = useT()
  const say = useSay()
  const days = known.days.map((each) => t(`health.day${each}` as Key)).join(', ')
  return (
    <>
      <p className={`note num ${known.ended ? 'warn' : 'info'}`}>
        {t('health.permits', { person: known.person, until: dateTime(known.until) })}
        {days && ` ${t('health.onDays', { days, at: known.at.slice(0, 5) })}`}
        {known.trigger && ` ${t('health.byTrigger', { pause: known.pause_min })}`}
        {known.next_due && ` ${t('health.nextDue', { when: dateTime(known.next_due) })}`}
        {known.ended && ` ${say.message(known.ended)}`}
      </p>
      <Button variant="default" loading={busy} onClick={onWithdraw}>
        {t('health.withdraw')}
      </Button>
      {known.attempts.length > 0 && (
        <div className="scroll-table">
          <table className="reported-values" aria-label={t('health.attempts')}>
            <tbody className="num">
              {known.attempts.slice(0, SHOWN).map((each) => (
                <tr key={`${each.at} ${each.outcome}`}>
                  <td>{dateTime(each.at)}</td>
                  <td>{t(`health.cause.${each.cause}`)}</td>
                  <td>
                    {t(`health.outcome.${each.outcome}`)}
                    {each.why && `: ${say.message(each.why)}`}
                    {each.remedy && ` – ${say.message(each.remedy)}`}
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </>
  )
}

function Permit({
  drive,
  onGiven,
}: {
  drive: string
  onGiven: (given: HealthPermissionInfo) => void
}) {
  const t = useT()
  const give = useAction()
  const [days, setDays] = useState<number[]>([])
  const [at, setAt] = useState('02:00')
  const [trigger, setTrigger] = useState(false)
  const [lasts, setLasts] = useState<number | null>(90)
  const [pause, setPause] = useState<number | null>(60)
  const [person, setPerson] = useState(() => localStorage.getItem('servodeck.report.person') ?? '')
  const [secured, setSecured] = useState(false)
  const toggle = (day: number) =>
    setDays((now) => (now.includes(day) ? now.filter((each) => each !== day) : [...now, day]))
  const go = () =>
    give.run(async () => {
      if (lasts === null || pause === null) return
      const params = { path: { drive_id: drive } }
      const until = new Date(Date.now() + lasts * DAY_MS).toISOString()
      const body = { until, days, at, trigger, pause_min: pause, person, secured }
      onGiven(await ask(api.PUT('/api/v1/drives/{drive_id}/health/permission', { params, body })))
      setSecured(false)
    })
  return (
    <>
      <div className="row wrap" role="group" aria-label={t('health.days')}>
        {DAYS.map((day) => (
          <Checkbox
            key={day}
            label={t(`health.day${day}` as Key)}
            checked={days.includes(day)}
            onChange={() => toggle(day)}
          />
        ))}
      </div>
      <div className="fields wide">
        <TextInput
          type="time"
          label={t('health.at')}
          value={at}
          onChange={(event) => setAt(event.currentTarget.value)}
        />
        <NumberField
          label={t('health.lasts')}
          value={lasts}
          min={1}
          max={366}
          onChange={setLasts}
        />
        <NumberField label={t('health.pause')} value={pause} min={5} onChange={setPause} />
        <TextInput
          label={t('health.permittedBy')}
          value={person}
          maxLength={200}
          onChange={(event) => setPerson(event.currentTarget.value)}
        />
      </div>
      <Checkbox
        label={t('health.trigger')}
        checked={trigger}
        onChange={(event) => setTrigger(event.currentTarget.checked)}
      />
      <p className="note warn">{t('health.warning')}</p>
      <Checkbox
        label={t('health.secured')}
        checked={secured}
        onChange={(event) => setSecured(event.currentTarget.checked)}
      />
      <div className="row wrap">
        <Button
          loading={give.busy}
          disabled={
            !secured ||
            (days.length === 0 && !trigger) ||
            lasts === null ||
            pause === null ||
            at === ''
          }
          onClick={() => void go()}
        >
          {t('health.permit')}
        </Button>
      </div>
      <ProblemNote problem={give.problem} onClose={give.clear} />
    </>
  )
}
