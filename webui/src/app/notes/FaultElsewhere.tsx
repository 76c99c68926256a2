import { VisuallyHidden } from '@mantine/core'
import { useMemo, useSyncExternalStore } from 'react'
import { useT } from '../../i18n'
import { contents, subscribe, useDrives } from '../../live/store'
import { Icon } from '../../widgets/layout/Icon'
import { href } from '../navigation/router'

/** The way to a fault of an axis that is not the chosen one: on a phone nothing else reports it. */
export function FaultElsewhere({ chosen }: { chosen: string | null }) {
  const t = useT()
  const drives = useDrives()
  const others = useMemo(
    () => (drives ?? []).map((each) => each.id).filter((id) => id !== chosen),
    [drives, chosen],
  )
  const faulty = useFaulty(others)
  const first = faulty[0]
  if (first === undefined) return null
  const names = faulty.map((id) => drives?.find((each) => each.id === id)?.name ?? id)
  const words = t('frame.faultElsewhere', { names: names.join(', ') })
  return (
    <a className="badge fault fault-elsewhere" href={href('alarms', first)} title={words}>
      <Icon name="alarms" size={16} />
      <span className="long" aria-hidden="true">
        {names[0]}
      </span>
      {faulty.length > 1 && <span aria-hidden="true">{faulty.length}</span>}
      <VisuallyHidden role="status">{words}</VisuallyHidden>
    </a>
  )
}

/** Those of the axes that have an active fault, in their order. */
function useFaulty(ids: string[]): string[] {
  const reported = useSyncExternalStore(
    (listener) => {
      const ends = ids.map((id) => subscribe(`state ${id}`, listener))
      return () => ends.forEach((end) => end())
    },
    () => ids.filter(hasFault).join('\n'),
  )
  return reported === '' ? [] : reported.split('\n')
}

const hasFault = (id: string): boolean =>
  contents.states.get(id)?.faults.some((each) => each.kind === 'fault') ?? false
