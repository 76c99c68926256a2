import { Button, Checkbox, Modal, NativeSelect, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import { setReadings, useAxisState, useReading } from '../../live/store'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { parseTyped } from '../../widgets/numbers/parse'
import { StartButton } from '../../widgets/jobs/StartButton'
import { useAction } from '../../widgets/requests/useAction'
import { useObstacle } from '../../widgets/jobs/useObstacle'
import { editText, range } from './GridRow'

/** States of CiA 402 in which the motor has no power, as the server asks for them. */
const WITHOUT_POWER = [
  'Not ready to switch on',
  'Switch on disabled',
  'Ready to switch on',
  'Fault',
]
const SHORTEST_REASON = 3

/** Asks for value, reason and consent before a setting is written that can start a motion. */
export function MotionSetting({
  drive,
  row,
  onClose,
}: {
  drive: string
  row: ParameterRow
  onClose: () => void
}) {
  const t = useT()
  const reading = useReading(drive, row.key) ?? row.reading
  const state = useAxisState(drive)
  const inTheWay = useObstacle(drive)
  const choices = Object.entries(row.enum)
  const [text, setText] = useState(() => editText(row, reading, choices.length > 0))
  const [reason, setReason] = useState('')
  const [agreed, setAgreed] = useState(false)
  const act = useAction()
  const typed = parseTyped(row, text, choices.length > 0)
  const wrong = typed.ok ? null : t(`typed.${typed.why}`, { limit: typed.limit ?? '' })
  const obstacle =
    inTheWay ??
    (state && !WITHOUT_POWER.includes(state.state) ? t('motion.disableFirst') : null) ??
    wrong ??
    (reason.trim().length < SHORTEST_REASON ? t('motion.reasonMissing') : null) ??
    (agreed ? null : t('start.agree'))
  const write = async () => {
    if (!typed.ok) return
    const [raw, value] = [typed.raw ?? null, typed.value ?? null]
    const done = await act.run(async () =>
      setReadings(drive, [
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/motion-settings/{key}', {
            params: { path: { drive_id: drive, key: row.key } },
            body: { raw, value, reason: reason.trim() },
          }),
        ),
      ]),
    )
    if (done) onClose()
  }
  return (
    <Modal opened onClose={onClose} title={`${row.key} ${row.name}`}>
      <div className="stack">
        <p className="note warn">{t('motion.settingWarning')}</p>
        {choices.length > 0 ? (
          <NativeSelect
            label={t('parameters.newValue')}
            value={text}
            onChange={(event) => setText(event.currentTarget.value)}
            data={[
              ...(text in row.enum ? [] : [{ value: text, label: text || '—' }]),
              ...choices.map(([value, label]) => ({ value, label: `${value} · ${label}` })),
            ]}
          />
        ) : (
          <TextInput
            label={t('parameters.newValue')}
            description={[range(row, false), row.unit].filter(Boolean).join(' ')}
            value={text}
            error={text === '' ? null : wrong}
            onChange={(event) => setText(event.currentTarget.value)}
          />
        )}
        <TextInput
          label={t('motion.reason')}
          maxLength={300}
          value={reason}
          onChange={(event) => setReason(event.currentTarget.value)}
        />
        <dl className="facts">
          <dt>{t('motion.untilLabel')}</dt>
          <dd>{t('motion.until')}</dd>
          <dt>{t('motion.withinLabel')}</dt>
          <dd>{t('motion.within')}</dd>
        </dl>
        <Checkbox
          label={t('motion.consent')}
          checked={agreed}
          onChange={(event) => setAgreed(event.currentTarget.checked)}
        />
        <ProblemNote problem={act.problem} onClose={act.clear} />
        <div className="row end">
          <Button onClick={onClose}>{t('cancel')}</Button>
          <StartButton obstacle={obstacle} busy={act.busy} onStart={() => void write()}>
            {t('motion.write')}
          </StartButton>
        </div>
      </div>
    </Modal>
  )
}
