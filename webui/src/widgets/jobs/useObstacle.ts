import type { AxisState } from '../../api/schema'
import { type Say, type T, useSay, useT } from '../../i18n'
import { useAxisState, useJob, useLink } from '../../live/store'

/** What keeps every motion of an axis from being started now, as text; null: nothing. */
export function useObstacle(drive: string): string | null {
  const t = useT()
  const say = useSay()
  const { open } = useLink()
  const state = useAxisState(drive)
  const job = useJob(state?.moving_job ?? null)
  return obstacleOf(t, say, open, state, job ? say.title(job) : '…')
}

function obstacleOf(
  t: T,
  say: Say,
  open: boolean,
  state: AxisState | null,
  title: string,
): string | null {
  if (!open) return t('start.noConnection')
  if (!state?.fresh) {
    const why = say.message(state?.problem_message, state?.problem)
    return [t('start.noAnswer'), why].join(' ').trim()
  }
  if (state.moving_job !== null) return t('jog.taken', { title })
  return null
}
