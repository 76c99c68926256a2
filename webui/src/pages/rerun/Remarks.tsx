import { Button, Checkbox, TagsInput, Textarea } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { RecordingInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useAction } from '../../widgets/useAction'

/** Notes, tags, and whether a stored recording is kept for ever. */
export function Remarks({
  recording,
  onChanged,
}: {
  recording: RecordingInfo
  onChanged: () => void
}) {
  const t = useT()
  const act = useAction()
  const [notes, setNotes] = useState(recording.notes)
  const [tags, setTags] = useState(recording.tags)
  const [kept, setKept] = useState(recording.kept)
  const path = { params: { path: { name: recording.name } } }
  return (
    <details className="remarks">
      <summary>{t('recordings.remarks')}</summary>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      <Textarea
        label={t('recordings.notes')}
        value={notes}
        maxLength={4000}
        autosize
        onChange={(event) => setNotes(event.currentTarget.value)}
      />
      <TagsInput label={t('recordings.tags')} value={tags} maxTags={20} onChange={setTags} />
      <div className="row wrap middle">
        <Checkbox
          className="grow"
          label={t('recordings.keep')}
          checked={kept}
          onChange={(event) => setKept(event.currentTarget.checked)}
        />
        <Button
          loading={act.busy}
          onClick={() =>
            void act
              .run(() =>
                ask(
                  api.PATCH('/api/v1/recordings/{name}', { ...path, body: { notes, tags, kept } }),
                ),
              )
              .then(onChanged)
          }
        >
          {t('recordings.saveRemarks')}
        </Button>
      </div>
    </details>
  )
}
