import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { RecordingList } from '../../api/schema'
import { useT } from '../../i18n'
import { NumberField } from '../../widgets/numbers/NumberField'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { useWrong } from '../../widgets/numbers/useWrong'
import { size } from './viewer'

const GIGA = 1e9

/** Room on the disk: what is left, where recording ends, and when old ones are deleted. */
export function RetentionPanel({
  list,
  onChanged,
}: {
  list: RecordingList
  onChanged: () => void
}) {
  const t = useT()
  const act = useAction()
  const { max_total_bytes: most, keep_days: days } = list.retention
  const [total, setTotal] = useState<number | null>(most === null ? null : most / GIGA)
  const [age, setAge] = useState<number | null>(days)
  const wrong = useWrong()
  const low = list.free_bytes < 2 * list.reserve_bytes
  return (
    <details className="retention">
      <summary className={low ? 'warn-text' : ''}>
        {t('recordings.room', {
          free: size(list.free_bytes),
          reserve: size(list.reserve_bytes),
        })}
      </summary>
      <p className="dim">{t('recordings.retentionHelp')}</p>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      <div className="row wrap">
        <NumberField
          label={t('recordings.total')}
          unit="GB"
          value={total}
          onChange={setTotal}
          onWrong={wrong.of('total')}
          optional
          min={0.001}
        />
        <NumberField
          label={t('recordings.days')}
          value={age}
          onChange={setAge}
          onWrong={wrong.of('age')}
          optional
          above={0}
        />
        <Button
          loading={act.busy}
          disabled={wrong.any}
          onClick={() =>
            void act
              .run(() =>
                ask(
                  api.PUT('/api/v1/recordings/retention', {
                    body: {
                      max_total_bytes: total === null ? null : Math.round(total * GIGA),
                      keep_days: age,
                    },
                  }),
                ),
              )
              .then(onChanged)
          }
        >
          {t('recordings.setRetention')}
        </Button>
      </div>
    </details>
  )
}
