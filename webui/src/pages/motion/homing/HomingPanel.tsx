import { NativeSelect } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { HomingMethodInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob, useLink } from '../../../live/store'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { ProfileText } from '../../../widgets/profile-text/ProfileText'
import { useSay } from '../../../widgets/profile-text/texts'
import { useAction } from '../../../widgets/requests/useAction'
import { useObstacle } from '../../../widgets/jobs/useObstacle'
import { useWrong } from '../../../widgets/numbers/useWrong'
import { Acceleration, MovesByItself, Speed, TorqueLimit, TravelLimit } from '../fields/fields'
import { HomingPicture } from './HomingPicture'
import { useRemembered } from '../../../widgets/browser/remembered'
import { placeIn, startIn, type TravelUnit } from '../fields/travelUnit'

export function HomingPanel({
  drive,
  unit,
  onStarted,
}: {
  drive: string
  unit: TravelUnit
  onStarted: (job: string) => void
}) {
  const t = useT()
  const say = useSay(drive)
  const { open } = useLink()
  const { units } = unit
  const [methods, setMethods] = useState<HomingMethodInfo[]>([])
  const [number, setNumber] = useState<number | null>(null)
  const [fast, setFast] = useState<number | null>(null)
  const [slow, setSlow] = useState<number | null>(null)
  const [acceleration, setAcceleration] = useState<number | null>(null)
  const [offset, setOffset] = useState<number | null>(null)
  const [travel, setTravel] = useRemembered(
    drive,
    placeIn(unit, 'home.travel'),
    startIn(unit, 'position', 10),
  )
  const [torque, setTorque] = useRemembered(drive, 'home.torque', 50)
  const [time, setTime] = useRemembered(drive, 'home.time', 60)
  const load = useAction()
  const start = useAction()
  const obstacle = useObstacle(drive)
  useEffect(() => {
    if (!open) return
    void load.run(async () => {
      const list = await ask(
        api.GET('/api/v1/drives/{drive_id}/homing-methods', {
          params: { path: { drive_id: drive } },
        }),
      )
      setMethods(list)
      setNumber((old) =>
        list.some((each) => each.method === old) ? old : (list[0]?.method ?? null),
      )
    })
  }, [drive, open, load.run])
  const method = methods.find((each) => each.method === number) ?? null
  const wrong = useWrong()
  // An optional field that holds something else than a number is not the drive's own value.
  const complete =
    !wrong.any && method !== null && travel !== null && torque !== null && time !== null
  const go = () =>
    start.run(async () => {
      if (number === null || travel === null || torque === null || time === null) return
      const job = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/home', {
          params: { path: { drive_id: drive } },
          body: {
            method: number,
            speed_switch: fast,
            speed_zero: slow,
            acceleration,
            offset,
            travel_limit: travel,
            torque_limit: torque,
            timeout_s: time,
            unit: unit.name,
          },
        }),
      )
      setJob(job)
      onStarted(job.id)
    })
  return (
    <Panel title={t('homing.title')}>
      <ProblemNote problem={load.problem} />
      <NativeSelect
        label={t('homing.method')}
        value={number === null ? '' : String(number)}
        onChange={(event) => setNumber(Number(event.currentTarget.value))}
        data={methods.map((each) => ({
          value: String(each.method),
          label: `${each.method} · ${say(each.name)}`,
        }))}
      />
      {method && (
        <>
          <HomingPicture method={method} name={say(method.name)} />
          <p className="prose">
            <ProfileText drive={drive} text={method.help} />
          </p>
          {method.notes && (
            <p className="dim">
              <ProfileText drive={drive} text={method.notes} />
            </p>
          )}
          <p className="dim">{t('source', { source: method.source })}</p>
        </>
      )}
      <div className="fields">
        <Speed
          units={units}
          label={t('homing.fast')}
          value={fast}
          onChange={setFast}
          onWrong={wrong.of('fast')}
          optional
        />
        <Speed
          units={units}
          label={t('homing.slow')}
          value={slow}
          onChange={setSlow}
          onWrong={wrong.of('slow')}
          optional
        />
        <Acceleration
          units={units}
          value={acceleration}
          onChange={setAcceleration}
          onWrong={wrong.of('acceleration')}
          optional
        />
        <NumberField
          label={t('homing.offset')}
          unit={units.position ?? ''}
          value={offset}
          onChange={setOffset}
          onWrong={wrong.of('offset')}
          optional
        />
        <TravelLimit units={units} value={travel} onChange={setTravel} />
        <TorqueLimit value={torque} onChange={setTorque} />
        <NumberField
          label={t('move.timeout')}
          unit="s"
          value={time}
          onChange={setTime}
          above={0}
          max={600}
        />
      </div>
      <p className="dim">{t('homing.empty')}</p>
      <MovesByItself {...{ units, travel, torque }} />
      <StartButton
        obstacle={obstacle ?? (complete ? null : t('start.incomplete'))}
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('homing.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
    </Panel>
  )
}
