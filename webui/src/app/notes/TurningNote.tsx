import { useMemo, useSyncExternalStore } from 'react'
import { useT } from '../../i18n'
import { contents, subscribe, useDrives } from '../../live/store'
import { stopEverything } from '../stop/stop'

/** Axes that turn although nobody may move them: on every page, for as long as they turn. */
export function TurningNote() {
  const t = useT()
  const drives = useDrives()
  const ids = useMemo(() => (drives ?? []).map((each) => each.id), [drives])
  const turning = useTurning(ids)
  if (turning.length === 0) return null
  return (
    <div className="note fault turning" role="alert">
      {turning.map((id) => {
        const found = contents.states.get(id)?.turning
        const name = drives?.find((each) => each.id === id)?.name ?? id
        if (!found) return null
        const speed = `${found.speed.toFixed(0)} ${found.unit}`
        return (
          <p key={id}>
            <strong>{t(`turning.${found.kind}`, { name, speed })}</strong>{' '}
            {t(`turning.${found.kind}.help`)}
          </p>
        )
      })}
      <button
        type="button"
        className="danger"
        // As with STOP itself: down, and a click alone by voice control and screen readers.
        onPointerDown={() => void stopEverything()}
        onClick={(event) => {
          if (event.detail === 0) void stopEverything()
        }}
      >
        {t('stop.label')}
      </button>
    </div>
  )
}

/** Those axes, in their order; their speeds come with the next change of state. */
function useTurning(ids: string[]): string[] {
  const reported = useSyncExternalStore(
    (listener) => {
      const ends = ids.map((id) => subscribe(`state ${id}`, listener))
      return () => ends.forEach((end) => end())
    },
    () => ids.map(mark).filter(Boolean).join('\n'),
  )
  return reported === ''
    ? []
    : reported.split('\n').map((each) => each.slice(0, each.indexOf('\t')))
}

function mark(id: string): string {
  const found = contents.states.get(id)?.turning
  return found ? `${id}\t${found.kind} ${found.speed.toFixed(0)}` : ''
}
