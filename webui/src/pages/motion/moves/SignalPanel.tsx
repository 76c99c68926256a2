import { NativeSelect, SegmentedControl } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AxisState, DriveSummary, GenerateRequest } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { useAction } from '../../../widgets/requests/useAction'
import { useObstacle } from '../../../widgets/jobs/useObstacle'
import { MovesByItself, Speed, TorqueLimit, TravelLimit } from '../fields/fields'
import { useBuses } from '../../../live/buses'
import { useRemembered } from '../../../widgets/browser/remembered'
import { placeIn, startIn, type TravelUnit } from '../fields/travelUnit'

/** Cyclic synchronous modes of CiA 402 and the quantity that each commands. */
const MODES = {
  CSP: { number: 8, quantity: 'position' },
  CSV: { number: 9, quantity: 'velocity' },
  CST: { number: 10, quantity: 'torque' },
} as const
type Mode = keyof typeof MODES
const SHAPES = ['step', 'ramp', 'trapezoid', 'sine', 'chirp'] as const

/** Whether an axis has a cyclic mode, and a bus that can exchange process data. */
export function useCyclic(drive: DriveSummary | null, state: AxisState | null): boolean {
  const { buses } = useBuses()
  const has = Object.values(MODES).some(({ number }) => state?.modes.includes(number))
  return (
    has &&
    buses.some(
      (bus) => bus.cyclic_possible && drive?.ports.some((port) => port.url === bus.url) === true,
    )
  )
}

/** A test signal in a cyclic mode, one value per bus cycle. */
export function SignalPanel({
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
  const { buses } = useBuses()
  const { units } = unit
  const possible = (Object.keys(MODES) as Mode[]).filter((mode) =>
    state?.modes.includes(MODES[mode].number),
  )
  const [chosen, setMode] = useState<Mode>('CSV')
  const mode = possible.includes(chosen) ? chosen : (possible[0] ?? 'CSV')
  const [shape, setShape] = useState<GenerateRequest['shape']>('sine')
  const [amplitude, setAmplitude] = useState<number | null>(null)
  const [frequency, setFrequency] = useState<number | null>(1)
  const [last, setLast] = useState<number | null>(10)
  const [duration, setDuration] = useState<number | null>(5)
  const [acceleration, setAcceleration] = useRemembered(
    drive.id,
    placeIn(unit, 'signal.acceleration'),
    unit.name === 'rev' ? 10 : Number(unit.travel(10).toPrecision(2)),
  )
  const [travel, setTravel] = useRemembered(
    drive.id,
    placeIn(unit, 'signal.travel'),
    startIn(unit, 'position', 5),
  )
  const [speed, setSpeed] = useRemembered(
    drive.id,
    placeIn(unit, 'signal.speed'),
    startIn(unit, 'velocity', 300),
  )
  const [torque, setTorque] = useRemembered(drive.id, 'signal.torque', 50)
  const start = useAction()
  const obstacle = useObstacle(drive.id)
  const key = `${drive.id} ${mode}`
  useEffect(() => {
    // An amplitude of another axis or mode is never carried over.
    setAmplitude(null)
  }, [key])
  const bus = buses.find((each) => drive.ports.some((port) => port.url === each.url && each.cyclic))
  const has = {
    frequency: shape === 'sine' || shape === 'chirp',
    last: shape === 'chirp',
    slope: shape === 'ramp' || shape === 'trapezoid',
  }
  const complete =
    ![amplitude, duration, travel, speed, torque].includes(null) &&
    !(has.frequency && frequency === null) &&
    !(has.last && last === null) &&
    !(has.slope && acceleration === null)
  const go = () =>
    start.run(async () => {
      if (
        !complete ||
        amplitude === null ||
        duration === null ||
        travel === null ||
        speed === null ||
        torque === null
      )
        return
      const job = await ask(
        api.POST('/api/v1/drives/{drive_id}/jobs/generate', {
          params: { path: { drive_id: drive.id } },
          body: {
            mode,
            shape,
            amplitude,
            duration_s: duration,
            // What the shape does not have is not looked at.
            frequency_hz: frequency ?? 1,
            frequency_end_hz: last ?? 10,
            acceleration: acceleration ?? 1,
            travel_limit: travel,
            speed_limit: speed,
            torque_limit: torque,
            unit: unit.name,
          },
        }),
      )
      setJob(job)
      onStarted(job.id)
    })
  return (
    <Panel title={t('signal.title')}>
      <p className="dim">{t('signal.help')}</p>
      {!bus?.cyclic?.running && (
        <p className="note warn">
          {t('signal.notRunning')} <a href="#/connect">{t('page.connect')}</a>
        </p>
      )}
      <SegmentedControl
        fullWidth
        value={mode}
        onChange={(next) => setMode(next)}
        data={possible.map((each) => ({ value: each, label: t(`signal.mode.${each}`) }))}
      />
      <div className="fields">
        <NativeSelect
          label={t('signal.shape')}
          value={shape}
          onChange={(event) => setShape(event.currentTarget.value as GenerateRequest['shape'])}
          data={SHAPES.map((each) => ({ value: each, label: t(`signal.${each}`) }))}
        />
        <NumberField
          // Its text goes with its value.
          key={key}
          label={t('signal.amplitude')}
          unit={units[MODES[mode].quantity] ?? ''}
          value={amplitude}
          onChange={setAmplitude}
        />
        {has.frequency && (
          <NumberField
            label={t(shape === 'chirp' ? 'signal.from' : 'signal.frequency')}
            unit="Hz"
            value={frequency}
            onChange={setFrequency}
            above={0}
            max={2000}
          />
        )}
        {has.last && (
          <NumberField
            label={t('signal.to')}
            unit="Hz"
            value={last}
            onChange={setLast}
            above={0}
            max={2000}
          />
        )}
        {has.slope && (
          <NumberField
            label={t('signal.slope')}
            unit={`${units[MODES[mode].quantity] ?? ''}/s`}
            value={acceleration}
            onChange={setAcceleration}
            above={0}
          />
        )}
        <NumberField
          label={t('signal.duration')}
          unit="s"
          value={duration}
          onChange={setDuration}
          above={0}
          max={120}
        />
        <TravelLimit units={units} value={travel} onChange={setTravel} />
        <Speed units={units} label={t('move.speedLimit')} value={speed} onChange={setSpeed} />
        <TorqueLimit value={torque} onChange={setTorque} />
      </div>
      <MovesByItself {...{ units, travel, torque }} />
      <StartButton
        obstacle={
          obstacle ??
          (!bus?.cyclic?.running ? t('start.noExchange') : !complete ? t('start.incomplete') : null)
        }
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('signal.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
    </Panel>
  )
}
