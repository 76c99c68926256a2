import { useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Mechanics } from '../../api/schema'
import { useAction } from '../../widgets/requests/useAction'
import { setRecord, useRecord } from '../../widgets/drive/useFunctions'
import { complete, type Form, formOf, START, toMechanics } from './mechanics'

/** What is typed of an axis' mechanics, beginning with what is kept, and keeping it. */
export function useMechanics(drive: string) {
  const kept = useRecord(drive)?.mechanics ?? null
  const [form, setForm] = useState<Form>(START)
  const act = useAction()
  useEffect(() => {
    setForm(kept ? formOf(kept) : START)
    // The text stands for what is kept.
  }, [drive, JSON.stringify(kept)])
  const keep = (mechanics: Mechanics | null) =>
    act.run(async () =>
      setRecord(
        drive,
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/mechanics', {
            params: { path: { drive_id: drive } },
            body: { mechanics },
          }),
        ),
      ),
    )
  return {
    kept,
    form,
    change: (part: Partial<Form>) => setForm((old) => ({ ...old, ...part })),
    /** Null while dimensions are missing. */
    mechanics: complete(form) ? toMechanics(form) : null,
    keep,
    act,
  }
}
