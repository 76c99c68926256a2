import { known, useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterFields } from '../../widgets/parameters/ParameterFields'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useSay } from '../../widgets/profile-text/texts'
import { useFunctions } from '../../widgets/drive/useFunctions'

/** How the axis stops, its range as a rotary axis, impedance: what the drive has of it. */
export function SettingsPanel({ drive }: { drive: string }) {
  const t = useT()
  const say = useSay(drive)
  const groups = (useFunctions(drive)?.groups ?? []).filter((group) => group.page === 'motion')
  if (groups.length === 0) return <p className="empty">{t('settings.none')}</p>
  return (
    <div className="stack">
      {groups.map((group) => {
        const name = known(t, 'group', group.name)
        return (
          <Panel key={group.name} title={name === group.name ? say(group.title) : name}>
            {group.help && (
              <p className="dim">
                <ProfileText drive={drive} text={group.help} />
              </p>
            )}
            <ParameterFields drive={drive} keys={group.keys} />
            {group.source && <p className="dim">{t('source', { source: group.source })}</p>}
          </Panel>
        )
      })}
    </div>
  )
}
