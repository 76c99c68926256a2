import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { RowNotExported } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { Said } from '../../../widgets/messages/Said'
import { useAction } from '../../../widgets/requests/useAction'
import { listUrl } from '../sets/sets'

type Format = 'csv' | 'dcf'

interface Missing {
  format: Format
  rows: RowNotExported[]
}

/** A set as lists for other tools, and the rows that the format of a downloaded one cannot hold. */
export function useListDownload(name: string) {
  const t = useT()
  const act = useAction()
  const [missing, setMissing] = useState<Missing | null>(null)
  const check = (format: Format) =>
    act.run(async () => {
      setMissing(null)
      const rows = await ask(
        api.GET('/api/v1/sets/{file}/list/left-out', {
          params: { path: { file: name }, query: { format } },
        }),
      )
      setMissing({ format, rows })
    })
  const buttons = (['csv', 'dcf'] as const).map((format) => (
    <Button
      key={format}
      component="a"
      href={listUrl(name, format)}
      download
      aria-label={t('sets.exportAs', { name, format: format.toUpperCase() })}
      onClick={() => void check(format)}
    >
      {format.toUpperCase()}
    </Button>
  ))
  const note = (
    <>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      {missing && missing.rows.length > 0 && (
        <div className="note" role="status">
          <p className="warn-text">
            {t('sets.notInList', {
              format: missing.format.toUpperCase(),
              count: missing.rows.length,
            })}
          </p>
          <ul>
            {missing.rows.map((row, at) => (
              <li key={`${row.key} ${at}`}>
                <span className="mono">{row.key}</span>{' '}
                <Said message={row.reason_message} words={row.reason} />
              </li>
            ))}
          </ul>
        </div>
      )}
    </>
  )
  return { buttons, note }
}
