import { Button, Checkbox, NativeSelect, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { MotionClass as Info, MotionClassRequest } from '../../api/schema'
import { hasRight } from '../../app/people/session'
import { useT } from '../../i18n'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useSay } from '../../widgets/profile-text/texts'
import { useAction } from '../../widgets/requests/useAction'

const CLASSES = ['none', 'at_enable', 'energises'] as const

/** Whether writing an object can cause motion, who says so, and the control to say otherwise. */
export function MotionClass({
  drive,
  profile,
  parameter,
}: {
  drive: string
  profile: string
  parameter: string
}) {
  const t = useT()
  const [info, setInfo] = useState<Info | null>(null)
  const act = useAction()
  const { run } = act
  useEffect(() => {
    let gone = false
    setInfo(null)
    void run(async () => {
      const found = await ask(
        api.GET('/api/v1/profiles/{profile}/parameters/{key}/motion', {
          params: { path: { profile, key: parameter } },
        }),
      )
      if (!gone) setInfo(found)
    })
    return () => {
      gone = true
    }
  }, [profile, parameter, run])
  const say = useSay(drive)
  if (!info) return <ProblemNote problem={act.problem} />
  if (info.motion === null) return null
  return (
    <section className="prose" aria-label={t('motionClass.title')}>
      <h3>{t('motionClass.title')}</h3>
      <p>{t(info.safe_in_motion ? 'motionClass.safe' : `motionClass.${info.motion}`)}</p>
      <p className="dim">
        {t(`motionClass.origin.${info.origin ?? 'unclassified'}`)}
        {info.origin === 'unclassified' ? '' : `: ${say(info.reason)}`}
      </p>
      {info.changeable && hasRight('station') && (
        <Choice profile={profile} parameter={parameter} info={info} onChange={setInfo} />
      )}
    </section>
  )
}

function Choice({
  profile,
  parameter,
  info,
  onChange,
}: {
  profile: string
  parameter: string
  info: Info
  onChange: (info: Info) => void
}) {
  const t = useT()
  const act = useAction()
  const [motion, setMotion] = useState<MotionClassRequest['motion']>(info.motion ?? 'energises')
  const [safe, setSafe] = useState(info.safe_in_motion)
  const [reason, setReason] = useState('')
  const path = { profile, key: parameter }
  const give = () =>
    act.run(async () => {
      const body = { motion, reason, safe_in_motion: motion === 'at_enable' && safe }
      onChange(
        await ask(
          api.PUT('/api/v1/profiles/{profile}/parameters/{key}/motion', { params: { path }, body }),
        ),
      )
      setReason('')
    })
  const forget = () =>
    act.run(async () =>
      onChange(
        await ask(
          api.DELETE('/api/v1/profiles/{profile}/parameters/{key}/motion', { params: { path } }),
        ),
      ),
    )
  return (
    <details>
      <summary>{t('motionClass.change')}</summary>
      <p className="note warn">{t('motionClass.warning')}</p>
      <NativeSelect
        label={t('motionClass.class')}
        value={motion}
        onChange={(event) => {
          const chosen = CLASSES.find((each) => each === event.currentTarget.value)
          if (chosen) setMotion(chosen)
        }}
        data={CLASSES.map((each) => ({ value: each, label: t(`motionClass.${each}`) }))}
      />
      {motion === 'at_enable' && (
        <Checkbox
          label={t('motionClass.safe')}
          checked={safe}
          onChange={(event) => setSafe(event.currentTarget.checked)}
        />
      )}
      <TextInput
        label={t('motionClass.reason')}
        maxLength={500}
        value={reason}
        onChange={(event) => setReason(event.currentTarget.value)}
      />
      <div className="row">
        <Button disabled={reason.trim().length < 3} loading={act.busy} onClick={() => void give()}>
          {t('motionClass.give')}
        </Button>
        {info.origin === 'person' && (
          <Button loading={act.busy} onClick={() => void forget()}>
            {t('motionClass.forget')}
          </Button>
        )}
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </details>
  )
}
