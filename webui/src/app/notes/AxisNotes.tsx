import { useRef } from 'react'
import type { AxisState } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { useAxisState } from '../../live/store'
import { Icon } from '../../widgets/layout/Icon'
import { href, type Page } from '../navigation/router'
import { listsFaults } from '../navigation/states'

/** What went wrong with an axis while its page is open: no answer, a fault. */
export function AxisNotes({ drive, page }: { drive: string; page: Page }) {
  const t = useT()
  const say = useSay()
  const state = useAxisState(drive)
  const reported = useFaultAtOpening(state)
  if (!state) return null
  if (!state.fresh) {
    return (
      <p className="note warn" role="status">
        <strong>{t('state.noAnswer')}</strong> {say.message(state.problem_message, state.problem)}
      </p>
    )
  }
  const faults = state.faults.filter((each) => each.kind === 'fault')
  if (listsFaults(page, reported) || faults.length === 0) return null
  return (
    <p className="note fault" role="alert">
      <Icon name="alarms" />
      <strong>
        {faults.map((each) => (
          <span key={`${each.code} ${each.name}`}>
            <span className="mono">{each.code}</span> {each.name}{' '}
          </span>
        ))}
      </strong>
      <a className="lone" href={href('alarms', drive)}>
        {t('frame.faultHere')}
      </a>
    </p>
  )
}

/**
 * Whether the axis had a fault or a warning when this page was opened: then it stands first on the
 * page, and stays there. What comes later is reported above the page, which it must not move.
 */
export function useFaultAtOpening(state: AxisState | null): boolean {
  const had = useRef<boolean | null>(null)
  if (had.current === null && state) had.current = state.faults.length > 0
  return had.current ?? false
}
