import { Checkbox, SegmentedControl } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AxisState, DriveSummary } from '../../../api/schema'
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

/** CiA 402 modes of operation that this panel commands. */
const MODES = { PP: 1, PV: 3, PT: 4 } as const
type Mode = keyof typeof MODES

export function MovePanel({
  drive,
  state,
  unit,
  onStarted,
}: {
  drive: DriveSummary
  state: AxisState | null
  unit: TravelUnit
  onStarted: (job: string) => void
}) {
  const t = useT()
  const { units } = unit
  const possible = (Object.keys(MODES) as Mode[]).filter(
    (each) => !state || state.modes.includes(MODES[each]),
  )
  const [chosen, setMode] = useState<Mode>('PP')
  const mode = possible.includes(chosen) ? chosen : (possible[0] ?? 'PP')
  const [target, setTarget] = useState<number | null>(null)
  const [relative, setRelative] = useState(true)
  const [consent, setConsent] = useState(false)
  const numbers = useMotionNumbers(drive.id, unit, 'move', 10)
  const [speed, acceleration] = [numbers.speed.value, numbers.acceleration.value]
  const [travel, torque] = [numbers.travel.value, numbers.torque.value]
  const [time, setTime] = useRemembered(drive.id, 'move.time', 10)
  const start = useAction()
  const obstacle = useObstacle(drive.id)
  const key = `${drive.id} ${mode}`
  useEffect(() => {
    // A target or consent of another axis or mode is never carried over.
    setTarget(null)
    setConsent(false)
  }, [key])
  // A drive's watchdog guards the cyclic exchange only, and profile modes run without it.
  const unwatched = mode !== 'PP'
  const targetUnit = { PP: units.position, PV: units.velocity, PT: units.torque }[mode] ?? ''
  const complete =
    target !== null &&
    travel !== null &&
    torque !== null &&
    time !== null &&
    acceleration !== null &&
    (mode === 'PV' || speed !== null)
  const go = () =>
    start.run(async () => {
      if (target === null || travel === null || torque === null || time === null) return
      const job = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/move', {
          params: { path: { drive_id: drive.id } },
          body: {
            mode,
            target,
            relative: mode === 'PP' && relative,
            immediate: true,
            speed: mode === 'PV' ? null : speed,
            acceleration,
            deceleration: acceleration,
            travel_limit: travel,
            torque_limit: torque,
            timeout_s: time,
            consent,
            unit: unit.name,
          },
        }),
      )
      setJob(job)
      onStarted(job.id)
      setConsent(false) // agreed to for one movement, not for the next
    })
  return (
    <Panel title={t('move.title')}>
      <SegmentedControl
        fullWidth
        value={mode}
        onChange={(next) => setMode(next)}
        data={possible.map((each) => ({ value: each, label: t(`move.mode.${each}`) }))}
      />
      <p className="dim">{t(`move.help.${mode}`)}</p>
      <div className="fields">
        <NumberField
          // Its text goes with its value.
          key={key}
          label={t('move.target')}
          unit={targetUnit}
          value={target}
          onChange={setTarget}
        />
        {mode !== 'PV' && (
          <Speed
            units={units}
            label={t(mode === 'PT' ? 'move.speedLimit' : 'motion.speed')}
            {...numbers.speed}
          />
        )}
        <Acceleration units={units} {...numbers.acceleration} />
        <TravelLimit units={units} {...numbers.travel} />
        <TorqueLimit {...numbers.torque} />
        <NumberField
          label={t(mode === 'PP' ? 'move.timeout' : 'move.time')}
          unit="s"
          value={time}
          onChange={setTime}
          above={0}
          max={600}
        />
      </div>
      {mode === 'PP' && (
        <Checkbox
          label={t('move.relative')}
          checked={relative}
          onChange={(event) => setRelative(event.currentTarget.checked)}
        />
      )}
      {unwatched && (
        <div className="note warn">
          <p>{t('move.consentText')}</p>
          <Checkbox
            label={t('move.consent')}
            checked={consent}
            onChange={(event) => setConsent(event.currentTarget.checked)}
          />
        </div>
      )}
      <MovesByItself {...{ units, travel, torque }} />
      <StartButton
        obstacle={
          obstacle ??
          (!complete ? t('start.incomplete') : unwatched && !consent ? t('start.agree') : null)
        }
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('move.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
    </Panel>
  )
}
