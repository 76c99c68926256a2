import { useState } from 'react'
import { useAction } from './useAction'

export interface Remarks {
  notes: string
  tags: string[]
}

/** What is sent: the own remarks, and what they were when the person began to change them. */
interface RemarksChange extends Remarks {
  base_notes: string
  base_tags: string[]
}

/** Notes and tags that are being changed; what another person wrote meanwhile is not overwritten. */
export function useRemarks(known: Remarks, save: (change: RemarksChange) => Promise<unknown>) {
  const act = useAction()
  const [mine, setMine] = useState<Remarks>({ notes: known.notes, tags: known.tags })
  const [base, setBase] = useState<Remarks>(mine)
  const write = async (from: Remarks): Promise<boolean> => {
    const sent = mine
    setBase(from)
    const done = await act.run(() =>
      save({ ...sent, base_notes: from.notes, base_tags: from.tags }),
    )
    if (done) setBase(sent)
    return done
  }
  const seen = (field: 'notes' | 'tags', theirs: string): Remarks =>
    field === 'notes'
      ? { ...base, notes: theirs }
      : { ...base, tags: theirs === '' ? [] : theirs.split(', ') }
  return {
    ...mine,
    act,
    change: (part: Partial<Remarks>) => setMine((now) => ({ ...now, ...part })),
    save: () => write(base),
    /** The other person's text in place of the own one; saved by nothing but a further press. */
    take: (field: 'notes' | 'tags', theirs: string) => {
      const now = seen(field, theirs)
      setBase(now)
      setMine((own) => ({ ...own, [field]: now[field] }))
      act.clear()
    },
    /** Save the own text over the one that was shown, and over no other. */
    overwrite: (field: 'notes' | 'tags', theirs: string) => write(seen(field, theirs)),
  }
}
