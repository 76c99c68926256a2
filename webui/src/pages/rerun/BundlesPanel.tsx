import { ActionIcon, Button, Checkbox, TextInput } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { API_ROOT, api, ask } from '../../api/client'
import type { BundleList } from '../../api/schema'
import { useT } from '../../i18n'
import { useLink } from '../../live/store'
import { dateTime } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { size } from './viewer'

const PERIOD_MS = 3000

/** What faults left behind, and whether the next one will. */
export function BundlesPanel() {
  const t = useT()
  const act = useAction()
  const { open } = useLink()
  const [list, setList] = useState<BundleList | null>(null)
  const [reason, setReason] = useState('')
  const refresh = useCallback(async () => {
    setList(await ask(api.GET('/api/v1/bundles')))
  }, [])
  useEffect(() => {
    if (!open) return
    const again = () => void refresh().catch(() => {}) // the frame shows that the link is gone
    again()
    const timer = setInterval(again, PERIOD_MS)
    return () => clearInterval(timer)
  }, [open, refresh])
  const run = (work: () => Promise<unknown>) => void act.run(work).then(refresh)
  return (
    <Panel title={t('bundles.title')}>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      <p className="dim">
        {t('bundles.help', { before: list?.before_s ?? 0, after: list?.after_s ?? 0 })}
      </p>
      <div className="row wrap">
        <Checkbox
          label={t('bundles.armed')}
          checked={list?.armed ?? false}
          disabled={list === null || act.busy}
          onChange={(event) => {
            const armed = event.currentTarget.checked
            run(() => ask(api.PUT('/api/v1/bundles/armed', { body: { armed } })))
          }}
        />
        <TextInput
          className="grow"
          label={t('bundles.reason')}
          value={reason}
          maxLength={200}
          onChange={(event) => setReason(event.currentTarget.value)}
        />
        <Button
          loading={act.busy}
          onClick={() =>
            run(async () => {
              const body = { reason: reason.trim() }
              await ask(api.POST('/api/v1/bundles', { body }))
              setReason('')
            })
          }
        >
          {t('bundles.make')}
        </Button>
      </div>
      {list?.bundles.length === 0 && <p className="dim">{t('bundles.none')}</p>}
      {list?.bundles.map((each) => (
        <article className="set" key={each.name}>
          <div className="grow">
            <strong>{each.name}</strong>
            <p className="dim">
              {dateTime(each.created)} · {size(each.bytes)}
            </p>
          </div>
          <Button
            component="a"
            href={`${API_ROOT}/api/v1/bundles/${encodeURIComponent(each.name)}`}
            download={each.name}
            leftSection={<Icon name="download" />}
          >
            {t('bundles.download')}
          </Button>
          <ActionIcon
            aria-label={t('recordings.delete', { name: each.name })}
            onClick={() =>
              run(() =>
                ask(
                  api.DELETE('/api/v1/bundles/{name}', { params: { path: { name: each.name } } }),
                ),
              )
            }
          >
            <Icon name="cross" />
          </ActionIcon>
        </article>
      ))}
    </Panel>
  )
}
