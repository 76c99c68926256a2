import { Button } from '@mantine/core'
import { api, ask } from '../../../api/client'
import type { ProfileInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { Icon } from '../../../widgets/layout/Icon'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { offerDownload } from '../../../widgets/browser/download'

/** A profile as files for other tools: EDS, and ESI where the drive has EtherCAT. */
export function ProfileExport({ profile, links }: Pick<ProfileInfo, 'profile' | 'links'>) {
  const t = useT()
  const save = useAction()
  const options = { params: { path: { profile } }, parseAs: 'text' } as const
  const eds = () =>
    save.run(async () => {
      const text = await ask(api.GET('/api/v1/profiles/{profile}/eds', options))
      offerDownload(`${profile}.eds`, [text], 'text/plain')
    })
  const esi = () =>
    save.run(async () => {
      const text = await ask(api.GET('/api/v1/profiles/{profile}/esi', options))
      offerDownload(`${profile}.xml`, [text], 'application/xml')
    })
  return (
    <>
      <div className="row">
        <Button
          loading={save.busy}
          leftSection={<Icon name="download" />}
          onClick={() => void eds()}
        >
          {t('notListed.exportEds')}
        </Button>
        {links.includes('ethercat') && (
          <Button
            loading={save.busy}
            leftSection={<Icon name="download" />}
            onClick={() => void esi()}
          >
            {t('notListed.exportEsi')}
          </Button>
        )}
      </div>
      <ProblemNote problem={save.problem} onClose={save.clear} />
    </>
  )
}
