import { Button, TextInput } from '@mantine/core'
import { useRef, useState } from 'react'
import { api, ask } from '../../api/client'
import type { AuditVerdict } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'

const ANCHOR = /^(\d{1,18}:[0-9a-f]{64})?$/

/** Checks that nothing was changed, and that an entry noted earlier is still in the chain. */
export function ChainCheck() {
  const t = useT()
  const say = useSay()
  const act = useAction()
  const [anchor, setAnchor] = useState('')
  const [verdict, setVerdict] = useState<AuditVerdict | null>(null)
  const good = ANCHOR.test(anchor.trim())
  const present = useRef(anchor)
  present.current = anchor
  const check = () =>
    act.run(async () => {
      setVerdict(null)
      const query = { anchor: anchor.trim() }
      const found = await ask(api.GET('/api/v1/audit/verify', { params: { query } }))
      if (present.current === anchor) setVerdict(found)
    })
  return (
    <Panel title={t('audit.check')}>
      <div className="row wrap end">
        <TextInput
          className="grow"
          label={t('audit.anchor')}
          value={anchor}
          error={good ? null : t('audit.anchorBad')}
          onChange={(event) => {
            // A verdict is of the anchor that was checked.
            setVerdict(null)
            setAnchor(event.currentTarget.value)
          }}
        />
        <Button loading={act.busy} disabled={!good} onClick={() => void check()}>
          {t('audit.check')}
        </Button>
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {verdict?.ok && (
        <div className="note info" role="status">
          <p>{t('audit.whole', { count: verdict.entries })}</p>
          <p className="mono anchor">{verdict.head}</p>
        </div>
      )}
      {verdict && !verdict.ok && (
        <div className="note fault" role="alert">
          <p>
            <strong>{t('audit.broken', { number: verdict.broken ?? 0 })}</strong>{' '}
            {say.message(verdict.why_message, verdict.why)}
          </p>
        </div>
      )}
    </Panel>
  )
}
