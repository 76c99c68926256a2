import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import { useT } from '../../../i18n'
import { dateTime, shown, toValue } from '../../../widgets/numbers/format'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useRows } from '../../../widgets/profile-text/rows'
import type { Raw } from '../../../widgets/parameters/types'
import { useAction } from '../../../widgets/requests/useAction'
import { changedSince, forget, noteForeign, noteUndone, useChanges, useForeign } from './undo'

/** The newest change to an axis, with the way back. */
export function UndoNote({ drive, onUndone }: { drive: string; onUndone: () => void }) {
  const t = useT()
  const last = useChanges(drive).at(-1)
  const act = useAction()
  const [tried, setTried] = useState('')
  const foreign = useForeign(drive)
  const others = foreign > 0 && (
    <p className="note warn" role="status">
      {t('undo.foreign', { count: foreign })}{' '}
      <button type="button" className="plain" onClick={() => noteForeign(drive)}>
        {t('close')}
      </button>
    </p>
  )
  if (!last) {
    return (
      <>
        {others}
        <ProblemNote problem={act.problem} onClose={act.clear} />
      </>
    )
  }
  // A refusal is of the change that was to be undone, not of one written since.
  const since = tried === last.time && changedSince(act.problem, last.before)
  const undo = () =>
    act.run(async () => {
      setTried(last.time)
      await ask(
        api.POST('/api/v1/drives/{drive_id}/tune/undo', {
          params: { path: { drive_id: drive } },
          // Over what somebody wrote since only where that is wanted.
          body: { before: last.before, after: since ? null : (last.after ?? null) },
        }),
      )
      forget(drive, last)
      noteUndone()
      onUndone()
    })
  return (
    <div className="note info">
      {others}
      <div className="row wrap middle">
        <span className="grow">
          {t(`undo.${last.what}`)} <span className="num dim">{dateTime(last.time)}</span>
        </span>
        <Button loading={act.busy} onClick={() => void undo()}>
          {t(since ? 'undo.all' : 'undo.button')}
        </Button>
      </div>
      <details>
        <summary>{t('undo.what', { count: Object.keys(last.before).length })}</summary>
        <Before drive={drive} values={last.before} />
      </details>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}

/** The values that an undo writes, by the names and in the units of the parameters. */
function Before({ drive, values }: { drive: string; values: Record<string, Raw> }) {
  const rows = new Map((useRows(drive) ?? []).map((row) => [row.key, row]))
  return (
    <dl className="facts">
      {Object.entries(values).map(([key, raw]) => {
        const row = rows.get(key)
        return (
          <div key={key} className="pair">
            <dt>
              <span className="mono dim">{row?.number ?? key}</span> {row?.name}
            </dt>
            <dd className="num">
              {row ? shown(row, toValue(row, raw), raw) : raw} {row?.unit}
            </dd>
          </div>
        )
      })}
    </dl>
  )
}
