import { Button, NumberInput } from '@mantine/core'
import { useRef, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DriveSummary, HandoverComparison } from '../../../api/schema'
import { useT } from '../../../i18n'
import { Icon } from '../../../widgets/layout/Icon'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { ConflictTable } from './ConflictTable'

/** A controller's list against our set and the drive: what the controller will overwrite. */
export function ControllerList({ drive, file }: { drive: DriveSummary; file: string }) {
  const t = useT()
  const input = useRef<HTMLInputElement>(null)
  const [slave, setSlave] = useState<number | string>('')
  const [list, setList] = useState('')
  const [found, setFound] = useState<HandoverComparison | null>(null)
  const act = useAction()
  const send = (chosen: File) =>
    act.run(async () => {
      setFound(null)
      setList(chosen.name)
      setFound(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/handover/compare', {
            params: {
              path: { drive_id: drive.id },
              query: {
                file: chosen.name.slice(0, 200),
                set_file: file,
                slave: typeof slave === 'number' ? slave : null,
              },
            },
            body: chosen as never,
            bodySerializer: (body: unknown) => body as BodyInit,
            headers: { 'Content-Type': 'application/octet-stream' },
          }),
        ),
      )
    })
  return (
    <section aria-label={t('handover.compareTitle')}>
      <h3>{t('handover.compareTitle')}</h3>
      <p className="dim">{t('handover.compareHelp')}</p>
      <div className="row wrap middle">
        <input
          ref={input}
          type="file"
          hidden
          aria-label={t('handover.choose')}
          onChange={(event) => {
            const chosen = event.currentTarget.files?.[0]
            event.currentTarget.value = ''
            if (chosen) void send(chosen)
          }}
        />
        <Button
          loading={act.busy}
          leftSection={<Icon name="upload" />}
          onClick={() => input.current?.click()}
        >
          {t('handover.choose')}
        </Button>
        <NumberInput
          label={t('handover.slave')}
          min={1}
          max={65535}
          allowDecimal={false}
          value={slave}
          onChange={setSlave}
        />
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {found && <Verdict list={list} found={found} />}
    </section>
  )
}

function Verdict({ list, found }: { list: string; found: HandoverComparison }) {
  const t = useT()
  return (
    <div role="status">
      <p>
        {t('handover.found', {
          file: `${list} (${found.format})`,
          conflicts: found.conflicts.length,
          same: found.same,
          defects: found.defects.length,
        })}
      </p>
      {found.conflicts.length === 0 ? (
        <p className="note">{t('handover.noConflict')}</p>
      ) : (
        <ConflictTable rows={found.conflicts} controller={t('handover.column.controller')} says />
      )}
      {found.restored.length > 0 && (
        <p className="note warn">{t('handover.restored', { keys: found.restored.join(', ') })}</p>
      )}
      {found.unknown_here.length > 0 && (
        <p className="dim">{t('handover.unknownHere', { keys: found.unknown_here.join(', ') })}</p>
      )}
      {found.not_read.length > 0 && (
        <p className="warn-text">{t('handover.unreadNow', { keys: found.not_read.join(', ') })}</p>
      )}
      {found.not_written.length > 0 && (
        <p className="dim">{t('handover.notWritten', { count: found.not_written.length })}</p>
      )}
      {found.defects.length > 0 && (
        <div className="note warn">
          <p>{t('handover.defects')}</p>
          <ul>
            {found.defects.map((each) => (
              <li key={`${each.place} ${each.kind}`}>
                <strong>{t(`handover.defect.${each.kind}`)}</strong>{' '}
                <span className="mono">{each.key}</span> {each.text}
              </li>
            ))}
          </ul>
        </div>
      )}
    </div>
  )
}
