import { NativeSelect } from '@mantine/core'
import { useT } from '../../i18n'
import type { TriggerSettings } from '../../live/trigger'
import { NumberField } from '../../widgets/NumberField'

export interface TriggerChoice {
  mode: 'off' | 'normal' | 'single'
  kind: TriggerSettings['kind']
  level: number
  before: number
  index: number
}

export function TriggerPanel({
  choice,
  names,
  unit,
  waiting,
  onChange,
}: {
  choice: TriggerChoice
  names: string[]
  unit: string
  waiting: boolean
  onChange: (choice: TriggerChoice) => void
}) {
  const t = useT()
  const on = choice.mode !== 'off'
  return (
    <div className="row wrap trigger">
      <NativeSelect
        label={t('trigger.mode')}
        value={choice.mode}
        onChange={(event) =>
          onChange({ ...choice, mode: event.currentTarget.value as TriggerChoice['mode'] })
        }
        data={(['off', 'normal', 'single'] as const).map((mode) => ({
          value: mode,
          label: t(`trigger.${mode}`),
        }))}
      />
      {on && (
        <>
          <NativeSelect
            label={t('trigger.channel')}
            value={String(choice.index)}
            onChange={(event) => onChange({ ...choice, index: Number(event.currentTarget.value) })}
            data={names.map((label, i) => ({ value: String(i), label }))}
          />
          <NativeSelect
            label={t('trigger.kind')}
            value={choice.kind}
            onChange={(event) =>
              onChange({ ...choice, kind: event.currentTarget.value as TriggerSettings['kind'] })
            }
            data={(['rising', 'falling', 'above', 'below'] as const).map((kind) => ({
              value: kind,
              label: t(`trigger.${kind}`),
            }))}
          />
          <NumberField
            label={t('trigger.level')}
            unit={unit}
            value={choice.level}
            onChange={(level) => level !== null && onChange({ ...choice, level })}
          />
          <NativeSelect
            label={t('trigger.before')}
            value={String(choice.before)}
            onChange={(event) => onChange({ ...choice, before: Number(event.currentTarget.value) })}
            data={[0, 0.1, 0.2, 0.5, 0.8].map((part) => ({
              value: String(part),
              label: `${part * 100} %`,
            }))}
          />
          {waiting && (
            <strong className="waiting" role="status">
              {t('trigger.waiting')}
            </strong>
          )}
        </>
      )}
    </div>
  )
}
