import { useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'

const TOPICS = ['serial', 'serialPermission', 'ethercat', 'can', 'nothing'] as const

/** Wiring and permissions, for the person in front of the cabinet. */
export function ConnectHelp() {
  const t = useT()
  return (
    <Panel title={t('help.title')}>
      {TOPICS.map((topic) => (
        <details key={topic}>
          <summary>{t(`help.${topic}.title`)}</summary>
          <p className="prose">{t(`help.${topic}.text`)}</p>
        </details>
      ))}
    </Panel>
  )
}
