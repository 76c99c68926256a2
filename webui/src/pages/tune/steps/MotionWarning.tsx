import { useT } from '../../../i18n'
import type { Limits } from '../../response/plot/limits'

/** What will move, within the limits that were permitted: next to every button that starts it. */
export function MotionWarning({
  limits,
  words = 'tool.moves',
}: {
  limits: Pick<Limits, 'travel_limit' | 'speed_limit' | 'torque_limit'>
  words?: 'tool.moves' | 'inertia.movesLimited' | 'inertia.movesTaught'
}) {
  const t = useT()
  return (
    <p className="note warn">
      {t(words, {
        travel: limits.travel_limit,
        speed: limits.speed_limit,
        torque: limits.torque_limit,
      })}
    </p>
  )
}
