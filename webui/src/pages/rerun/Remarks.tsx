import { Button, Checkbox, TagsInput, Textarea } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { RecordingInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { ChangedMeanwhile } from '../../widgets/messages/ChangedMeanwhile'
import { useRemarks } from '../../widgets/requests/useRemarks'

/** Notes, tags, and whether a stored recording is kept for ever. */
export function Remarks({
  recording,
  onChanged,
}: {
  recording: RecordingInfo
  onChanged: () => void
}) {
  const t = useT()
  const [kept, setKept] = useState(recording.kept)
  const path = { params: { path: { name: recording.name } } }
  const remarks = useRemarks(recording, (change) =>
    ask(api.PATCH('/api/v1/recordings/{name}', { ...path, body: { ...change, kept } })),
  )
  const done = (saved: boolean) => saved && onChanged()
  return (
    <details className="remarks">
      <summary>{t('recordings.remarks')}</summary>
      <ChangedMeanwhile
        problem={remarks.act.problem}
        mine={remarks}
        busy={remarks.act.busy}
        onTake={remarks.take}
        onOverwrite={(field, theirs) => void remarks.overwrite(field, theirs).then(done)}
        onClose={remarks.act.clear}
      />
      <Textarea
        label={t('recordings.notes')}
        value={remarks.notes}
        maxLength={4000}
        autosize
        onChange={(event) => remarks.change({ notes: event.currentTarget.value })}
      />
      <TagsInput
        label={t('recordings.tags')}
        value={remarks.tags}
        maxTags={20}
        onChange={(tags) => remarks.change({ tags })}
      />
      <div className="row wrap middle">
        <Checkbox
          className="grow"
          label={t('recordings.keep')}
          checked={kept}
          onChange={(event) => setKept(event.currentTarget.checked)}
        />
        <Button loading={remarks.act.busy} onClick={() => void remarks.save().then(done)}>
          {t('recordings.saveRemarks')}
        </Button>
      </div>
    </details>
  )
}
