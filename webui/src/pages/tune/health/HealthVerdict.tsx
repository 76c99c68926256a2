import { Button, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AxisHealth } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { LEAST_ROUNDS, signable, toneOf } from './health'

/** Each quantity against the baseline, what has changed first, with the next step. */
export function Findings({ health }: { health: AxisHealth }) {
  const t = useT()
  const say = useSay()
  if (!health.baseline) return null
  if (!health.baseline.intact) return <p className="note fault">{t('health.notIntact')}</p>
  const urgent = ['changed', 'not_seen', 'suspected']
  const rank = (code: string) => (urgent.includes(code) ? urgent.indexOf(code) : urgent.length)
  const sorted = [...health.findings].sort((a, b) => rank(a.code) - rank(b.code))
  return (
    <>
      {sorted.map((each) => (
        <div
          key={`${each.quantity} ${each.number}`}
          className={`note ${toneOf(each)}`}
          role={each.code === 'changed' ? 'alert' : undefined}
        >
          <p className="num">{say.message(each.message)}</p>
          {each.next_step && <p>{say.message(each.next_step)}</p>}
        </div>
      ))}
      {health.other_settings > 0 && (
        <p className="note info">{t('health.otherSettings', { count: health.other_settings })}</p>
      )}
    </>
  )
}

/** Sign the rounds of the newest check, where they are enough. */
export function SignBaseline({
  drive,
  health,
  onSigned,
}: {
  drive: string
  health: AxisHealth
  onSigned: (health: AxisHealth) => void
}) {
  const t = useT()
  const sign = useAction()
  const [person, setPerson] = useState(() => localStorage.getItem('servodeck.report.person') ?? '')
  const [notes, setNotes] = useState('')
  const runs = signable(health)
  if (runs.length === 0) {
    return <p className="dim">{t('health.tooFew', { count: LEAST_ROUNDS })}</p>
  }
  if (health.baseline && runs.every((id) => health.baseline?.runs.includes(id))) return null
  const go = () =>
    sign.run(async () => {
      const params = { path: { drive_id: drive } }
      const body = { runs, person, notes }
      onSigned(await ask(api.POST('/api/v1/drives/{drive_id}/health/baseline', { params, body })))
    })
  return (
    <>
      <div className="fields wide">
        <TextInput
          label={t('health.person')}
          value={person}
          maxLength={200}
          onChange={(event) => setPerson(event.currentTarget.value)}
        />
        <TextInput
          label={t('health.notes')}
          value={notes}
          maxLength={4000}
          onChange={(event) => setNotes(event.currentTarget.value)}
        />
      </div>
      <div className="row wrap">
        <Button loading={sign.busy} onClick={() => void go()}>
          {t('health.sign', { count: runs.length })}
        </Button>
      </div>
      <ProblemNote problem={sign.problem} onClose={sign.clear} />
    </>
  )
}
