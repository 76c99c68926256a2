import { Button } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AxisState } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { useAction } from '../../../widgets/requests/useAction'
import { useObstacle } from '../../../widgets/jobs/useObstacle'
import { Acceleration, MovesByItself, Speed, TorqueLimit, TravelLimit } from '../fields/fields'
import { useRemembered } from '../../../widgets/browser/remembered'
import type { TravelUnit } from '../fields/travelUnit'
import { useMotionNumbers } from '../fields/useMotionNumbers'

/** Back and forth between two absolute positions. */
export function SequencePanel({
  drive,
  state,
  unit,
  onStarted,
}: {
  drive: string
  state: AxisState | null
  unit: TravelUnit
  onStarted: (job: string) => void
}) {
  const t = useT()
  const { units } = unit
  const [first, setFirst] = useState<number | null>(null)
  const [second, setSecond] = useState<number | null>(null)
  const [dwell, setDwell] = useRemembered(drive, 'sequence.dwell', 0.5)
  const [count, setCount] = useRemembered(drive, 'sequence.count', 5)
  const numbers = useMotionNumbers(drive, unit, 'sequence', 5)
  const [speed, acceleration] = [numbers.speed.value, numbers.acceleration.value]
  const [travel, torque] = [numbers.travel.value, numbers.torque.value]
  const start = useAction()
  const obstacle = useObstacle(drive)
  useEffect(() => {
    // Positions of another axis are never carried over.
    if (drive) {
      setFirst(null)
      setSecond(null)
    }
  }, [drive])
  const here =
    state?.fresh && state.position !== null ? Number(unit.travel(state.position).toFixed(4)) : null
  const values = [first, second, dwell, count, speed, acceleration, travel, torque]
  const go = () =>
    start.run(async () => {
      if (
        first === null ||
        second === null ||
        dwell === null ||
        count === null ||
        speed === null ||
        acceleration === null ||
        travel === null ||
        torque === null
      )
        return
      const job = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/sequence', {
          params: { path: { drive_id: drive } },
          body: {
            first,
            second,
            speed,
            acceleration,
            dwell_s: dwell,
            count,
            travel_limit: travel,
            torque_limit: torque,
            unit: unit.name,
          },
        }),
      )
      setJob(job)
      onStarted(job.id)
    })
  return (
    <Panel title={t('sequence.title')}>
      <p className="dim">{t('sequence.help')}</p>
      <div className="fields">
        <div className="with-button">
          <NumberField
            label={t('sequence.first')}
            unit={units.position ?? ''}
            value={first}
            onChange={setFirst}
          />
          <Button disabled={here === null} onClick={() => setFirst(here)}>
            {t('sequence.here')}
          </Button>
        </div>
        <div className="with-button">
          <NumberField
            label={t('sequence.second')}
            unit={units.position ?? ''}
            value={second}
            onChange={setSecond}
          />
          <Button disabled={here === null} onClick={() => setSecond(here)}>
            {t('sequence.here')}
          </Button>
        </div>
        <Speed units={units} {...numbers.speed} />
        <Acceleration units={units} {...numbers.acceleration} />
        <NumberField
          label={t('sequence.dwell')}
          unit="s"
          value={dwell}
          onChange={setDwell}
          min={0}
          max={60}
        />
        <NumberField
          label={t('sequence.count')}
          value={count}
          onChange={setCount}
          min={1}
          max={100000}
          integer
        />
        <TravelLimit units={units} {...numbers.travel} />
        <TorqueLimit {...numbers.torque} />
      </div>
      <MovesByItself {...{ units, travel, torque }} />
      <StartButton
        obstacle={obstacle ?? (values.includes(null) ? t('start.incomplete') : null)}
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('sequence.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
    </Panel>
  )
}
