import { Checkbox } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useT } from '../../../i18n'
import { useAxisState, useDrive } from '../../../live/store'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { useRemembered } from '../../../widgets/browser/remembered'

/** The motion envelope of every measurement; `null` while a field is not filled in. */
export interface Limits {
  travel_limit: number
  speed_limit: number
  torque_limit: number
  time_limit_s: number
  /** Given for one measurement where nothing in the drive ends a speed. */
  consent: boolean
}

/** Limits of one axis, the same on both pages and kept in this browser. */
export function useLimits(drive: string) {
  const [travel, setTravel] = useRemembered(drive, 'tune.travel', 3)
  const [speed, setSpeed] = useRemembered(drive, 'tune.speed', 1200)
  const [torque, setTorque] = useRemembered(drive, 'tune.torque', 80)
  const [time, setTime] = useRemembered(drive, 'tune.time', 60)
  const unwatched = useUnwatched(drive)
  const [consent, setConsent] = useState(false)
  const moving = useAxisState(drive)?.moving_job != null
  const key = `${drive} ${moving}`
  useEffect(() => {
    // Agreed to for one axis and one measurement, never for the next.
    setConsent(false)
  }, [key])
  const limits: Limits | null =
    travel === null || speed === null || torque === null || time === null
      ? null
      : {
          travel_limit: travel,
          speed_limit: speed,
          torque_limit: torque,
          time_limit_s: time,
          consent,
        }
  return {
    travel,
    setTravel,
    speed,
    setSpeed,
    torque,
    setTorque,
    time,
    setTime,
    limits,
    unwatched,
    consent,
    setConsent,
    /** Whether a measurement may be started as far as limits and consent go. */
    agreed: limits !== null && (consent || !unwatched),
  }
}

/** Whether nothing in the drive ends a speed when this computer falls silent. */
function useUnwatched(drive: string): boolean {
  const ports = useDrive(drive)?.ports ?? []
  const port = ports.find((each) => each.kind === 'ethercat' || each.kind === 'canopen')
  return port !== undefined && !port.watchdog
}

export function LimitFields({ of }: { of: ReturnType<typeof useLimits> }) {
  const t = useT()
  return (
    <>
      <Numbers of={of} />
      {of.unwatched && (
        <div className="note warn">
          <p>{t('unwatched.why')}</p>
          <Checkbox
            label={t('unwatched.consent')}
            checked={of.consent}
            onChange={(event) => of.setConsent(event.currentTarget.checked)}
          />
        </div>
      )}
    </>
  )
}

function Numbers({ of }: { of: ReturnType<typeof useLimits> }) {
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
