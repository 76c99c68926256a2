import { stateLook, stateSign } from '../../app/navigation/states'
import { useT } from '../../i18n'
import { useAxisStates, useDrives } from '../../live/store'
import { StateName } from '../../widgets/drive/StateName'

/**
 * The states of the axes beneath the scene, in the page's language: viser has one label for all who
 * look, so that in the scene itself a state is a sign, which is explained here. With `axis` of
 * that one alone.
 */
export function SceneStates({ axis }: { axis?: string }) {
  const t = useT()
  const drives = (useDrives() ?? []).filter((each) => axis === undefined || each.id === axis)
  const states = useAxisStates(drives.map((each) => each.id))
  return (
    <ul className="scene-states" aria-label={t('scene.states')}>
      {drives.map((drive, place) => {
        const state = states[place] ?? null
        return (
          <li key={drive.id} data-drive={drive.id} className={stateLook(state).tone}>
            {`${drive.name} [${stateSign(state)}] `}
            {state?.fresh ? (
              <StateName state={state.state} />
            ) : (
              t(state ? 'state.noAnswer' : 'state.unknown')
            )}
          </li>
        )
      })}
    </ul>
  )
}
