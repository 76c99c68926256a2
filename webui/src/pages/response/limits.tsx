import { useT } from '../../i18n'
import { NumberField } from '../../widgets/NumberField'
import { useRemembered } from '../motion/remembered'

/** The motion envelope of every measurement; `null` while a field is not filled in. */
export interface Limits {
  travel_limit: number
  speed_limit: number
  torque_limit: number
  time_limit_s: number
}

/** Limits of one axis, the same on both pages and kept in this browser. */
export function useLimits(drive: string) {
  const [travel, setTravel] = useRemembered(drive, 'tune.travel', 3)
  const [speed, setSpeed] = useRemembered(drive, 'tune.speed', 1200)
  const [torque, setTorque] = useRemembered(drive, 'tune.torque', 80)
  const [time, setTime] = useRemembered(drive, 'tune.time', 60)
  const limits: Limits | null =
    travel === null || speed === null || torque === null || time === null
      ? null
      : { travel_limit: travel, speed_limit: speed, torque_limit: torque, time_limit_s: time }
  return { travel, setTravel, speed, setSpeed, torque, setTorque, time, setTime, limits }
}

export function LimitFields({ of }: { of: ReturnType<typeof useLimits> }) {
  const t = useT()
  return (
    <div className="fields">
      <NumberField
        label={t('motion.travelLimit')}
        unit="rev"
        value={of.travel}
        onChange={of.setTravel}
        above={0}
      />
      <NumberField
        label={t('move.speedLimit')}
        unit="rpm"
        value={of.speed}
        onChange={of.setSpeed}
        above={0}
      />
      <NumberField
        label={t('motion.torqueLimit')}
        unit="%"
        value={of.torque}
        onChange={of.setTorque}
        above={0}
        max={400}
      />
      <NumberField
        label={t('move.timeout')}
        unit="s"
        value={of.time}
        onChange={of.setTime}
        above={0}
        max={300}
      />
    </div>
  )
}
