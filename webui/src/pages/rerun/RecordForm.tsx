import { Button, NativeSelect, TagsInput, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { StartRecording } from '../../api/schema'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { POSITION_ACTUAL, TORQUE_ACTUAL, VELOCITY_ACTUAL } from '../../widgets/parameters/objects'
import { NumberField } from '../../widgets/numbers/NumberField'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { useWrong } from '../../widgets/numbers/useWrong'
import { storedChannels } from '../scope/setup/channels'
import { useScopeChannels } from '../scope/useScope'

const KINDS = ['none', 'rising', 'falling', 'change', 'fault'] as const
type Kind = (typeof KINDS)[number]
type Trigger = NonNullable<StartRecording['trigger']>

/** What to record, when it begins and when it ends. */
export function RecordForm({ onStarted }: { onStarted: () => void }) {
  const t = useT()
  const drives = useDrives() ?? []
  const infos = useScopeChannels()
  const channels = useChannels()
  const act = useAction()
  const [name, setName] = useState('')
  const [notes, setNotes] = useState('')
  const [tags, setTags] = useState<string[]>([])
  const [kind, setKind] = useState<Kind>('none')
  const [place, setPlace] = useState(0)
  const [level, setLevel] = useState<number | null>(0)
  const [mask, setMask] = useState<number | null>(null)
  const [faultOf, setFaultOf] = useState('')
  const [before, setBefore] = useState<number | null>(1)
  const [seconds, setSeconds] = useState<number | null>(null)
  const wrong = useWrong()
  const on = channels[place] ?? channels[0]
  const info = on ? infos.get(`${on.drive} ${on.key}`) : undefined
  const trigger = (): Trigger | null => {
    if (kind === 'none') return null
    if (kind === 'fault') return { kind, drive: faultOf, key: '', level: 0, mask: null }
    const { drive = '', key = '' } = on ?? {}
    return { kind, drive, key, level: level ?? 0, mask: kind === 'change' ? mask : null }
  }
  const start = () =>
    act.run(async () => {
      await ask(
        api.POST('/api/v1/recordings', {
          body: {
            name,
            notes,
            tags,
            channels,
            period_s: 0,
            pre_s: kind === 'none' ? 0 : (before ?? 0),
            trigger: trigger(),
            duration_s: seconds,
          },
        }),
      )
      setName('')
      setNotes('')
      onStarted()
    })
  const edge = kind === 'rising' || kind === 'falling'
  return (
    <Panel title={t('recordings.start')}>
      <ProblemNote problem={act.problem} onClose={act.clear} />
      <p className="dim">{t('recordings.what', { count: channels.length })}</p>
      <div className="row wrap">
        <TextInput
          label={t('recordings.name')}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <TextInput
          className="grow"
          label={t('recordings.notes')}
          value={notes}
          onChange={(event) => setNotes(event.currentTarget.value)}
        />
        <TagsInput label={t('recordings.tags')} value={tags} maxTags={20} onChange={setTags} />
      </div>
      <div className="row wrap record-when">
        <NativeSelect
          label={t('recordings.begin')}
          value={kind}
          onChange={(event) => setKind(event.currentTarget.value as Kind)}
          data={KINDS.map((each) => ({ value: each, label: t(`recordings.begin.${each}`) }))}
        />
        {kind === 'fault' && (
          <NativeSelect
            label={t('frame.axis')}
            value={faultOf}
            onChange={(event) => setFaultOf(event.currentTarget.value)}
            data={[
              { value: '', label: t('recordings.anyAxis') },
              ...drives.map((each) => ({ value: each.id, label: each.name })),
            ]}
          />
        )}
        {(edge || kind === 'change') && (
          <NativeSelect
            label={t('recordings.signal')}
            value={String(place)}
            onChange={(event) => setPlace(Number(event.currentTarget.value))}
            data={channels.map((each, i) => ({
              value: String(i),
              label: `${drives.find((drive) => drive.id === each.drive)?.name ?? each.drive} ${
                infos.get(`${each.drive} ${each.key}`)?.name ?? each.key
              }`,
            }))}
          />
        )}
        {edge && (
          <NumberField
            label={t('trigger.level')}
            value={level}
            onChange={setLevel}
            {...(info?.unit ? { unit: info.unit } : {})}
          />
        )}
        {kind === 'change' && (
          <NumberField
            label={t('recordings.mask')}
            value={mask}
            onChange={setMask}
            onWrong={wrong.of('mask')}
            optional
            integer
            min={1}
            max={4294967295}
          />
        )}
        {kind !== 'none' && (
          <NumberField
            label={t('recordings.before')}
            unit="s"
            value={before}
            onChange={setBefore}
            onWrong={wrong.of('before')}
            min={0}
            max={60}
          />
        )}
        <NumberField
          label={t('recordings.seconds')}
          unit="s"
          value={seconds}
          onChange={setSeconds}
          onWrong={wrong.of('seconds')}
          optional
          above={0}
          max={604800}
        />
        <Button
          variant="filled"
          loading={act.busy}
          disabled={channels.length === 0 || wrong.any || (edge && level === null)}
          onClick={() => void start()}
        >
          {t(kind === 'none' ? 'recordings.start' : 'recordings.arm')}
        </Button>
      </div>
    </Panel>
  )
}

/** What the Scope page shows, or position, speed and torque of every axis. */
function useChannels() {
  const drives = useDrives() ?? []
  const known = new Set(drives.map((each) => each.id))
  const chosen = (storedChannels() ?? []).filter((each) => known.has(each.drive))
  if (chosen.length > 0) return chosen
  return drives.flatMap(({ id }) =>
    [POSITION_ACTUAL, VELOCITY_ACTUAL, TORQUE_ACTUAL].map((key) => ({ drive: id, key })),
  )
}
