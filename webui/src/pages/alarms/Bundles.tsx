import { Button } from '@mantine/core'
import { API_ROOT, api, ask } from '../../api/client'
import type { BundleList } from '../../api/schema'
import { useT } from '../../i18n'
import { dateTime } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { useFetched } from '../../widgets/drive/useFunctions'
import { size } from '../rerun/viewer'

const SHOWN = 5

/** Everything that a helper far away needs, in one file. */
export function Bundles() {
  const t = useT()
  const act = useAction()
  const { data, problem, read } = useFetched<BundleList>(() => ask(api.GET('/api/v1/bundles')), [])
  const make = () =>
    act.run(async () => {
      await ask(api.POST('/api/v1/bundles', { body: { reason: '' } }))
      await read()
    })
  return (
    <Panel
      title={t('bundle.title')}
      tools={
        <Button loading={act.busy} onClick={() => void make()}>
          {t('bundle.make')}
        </Button>
      }
    >
      <p className="prose">{t('bundle.help')}</p>
      {data && <p className="dim">{t(data.armed ? 'bundle.armed' : 'bundle.notArmed')}</p>}
      <ProblemNote problem={act.problem ?? problem} onClose={act.clear} />
      {data?.bundles.length === 0 && <p className="dim">{t('bundle.none')}</p>}
      <ul className="plain-list">
        {data?.bundles.slice(0, SHOWN).map((bundle) => (
          <li key={bundle.name}>
            <a
              className="download"
              href={`${API_ROOT}/api/v1/bundles/${encodeURIComponent(bundle.name)}`}
              download={bundle.name}
            >
              <Icon name="download" /> {bundle.name}
            </a>
            <p className="dim num">
              {dateTime(bundle.created)} · {size(bundle.bytes)}
            </p>
          </li>
        ))}
      </ul>
    </Panel>
  )
}
