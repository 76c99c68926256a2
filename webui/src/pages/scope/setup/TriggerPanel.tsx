import { Button, NativeSelect } from '@mantine/core'
import type { ScopeSetup } from '../../../api/schema'
import { useT } from '../../../i18n'
import { useDrives } from '../../../live/store'
import type { ScopeFrame } from '../../../live/worker/worker-messages'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { needsBit, needsDrive, needsHigh, needsLevel, type Shown } from './setup'

const MODES = ['off', 'auto', 'normal', 'single'] as const
const KINDS = [
  'rising',
  'falling',
  'either',
  'above',
  'below',
  'enters',
  'leaves',
  'bit_set',
  'bit_clear',
  'change',
  'fault',
  'motion',
] as const
/** A speed above the noise of an encoder at standstill, in rpm. */
const MOTION_RPM = 30

type Choice = ScopeSetup['trigger']

export function TriggerPanel({
  choice,
  shown,
  state,
  persistence,
  onChange,
  onPersistence,
  onArm,
}: {
  choice: Choice
  shown: Shown[]
  state: ScopeFrame['trigger'] | null
  persistence: number
  onChange: (choice: Choice) => void
  onPersistence: (sweeps: number) => void
  onArm: () => void
}) {
  const t = useT()
  const drives = useDrives() ?? []
  const on = choice.mode !== 'off'
  const { kind } = choice
  const trace = shown.find((each) => each.id === choice.trace) ?? shown[0]
  // An axis that was removed, or of another machine's set-up: no other one takes its place.
  const gone = needsDrive(kind) && !drives.some((each) => each.id === choice.drive)
  const unit = kind === 'motion' ? 'rpm' : (trace?.unit ?? '')
  const chooseKind = (next: Choice['kind']) => {
    const drive = choice.drive || (drives[0]?.id ?? '')
    const level = next === 'motion' && kind !== 'motion' ? MOTION_RPM : choice.level
    onChange({ ...choice, kind: next, drive, level })
  }
  return (
    <div className="row wrap trigger">
      <NativeSelect
        label={t('trigger.mode')}
        value={choice.mode}
        onChange={(event) =>
          onChange({ ...choice, mode: event.currentTarget.value as Choice['mode'] })
        }
        data={MODES.map((mode) => ({ value: mode, label: t(`trigger.${mode}`) }))}
      />
      {on && (
        <>
          <NativeSelect
            label={t('trigger.kind')}
            value={kind}
            onChange={(event) => chooseKind(event.currentTarget.value as Choice['kind'])}
            data={KINDS.map((each) => ({ value: each, label: t(`trigger.${each}`) }))}
          />
          {needsDrive(kind) ? (
            <NativeSelect
              label={t('frame.axis')}
              value={choice.drive}
              error={gone && t('trigger.gone', { axis: choice.drive })}
              onChange={(event) => onChange({ ...choice, drive: event.currentTarget.value })}
              data={[
                ...(gone ? [{ value: choice.drive, label: choice.drive || '—' }] : []),
                ...drives.map((each) => ({ value: each.id, label: each.name })),
              ]}
            />
          ) : (
            <NativeSelect
              label={t('trigger.channel')}
              value={trace?.id ?? ''}
              onChange={(event) => onChange({ ...choice, trace: event.currentTarget.value })}
              data={shown.map((each) => ({ value: each.id, label: each.label }))}
            />
          )}
          {needsLevel(kind) && (
            <NumberField
              label={t(needsHigh(kind) ? 'trigger.low' : 'trigger.level')}
              unit={unit}
              value={choice.level}
              onChange={(level) => level !== null && onChange({ ...choice, level })}
            />
          )}
          {needsHigh(kind) && (
            <NumberField
              label={t('trigger.high')}
              unit={unit}
              value={choice.high}
              min={choice.level}
              onChange={(high) => high !== null && onChange({ ...choice, high })}
            />
          )}
          {needsBit(kind) && (
            <NumberField
              label={t('trigger.bit')}
              integer
              min={0}
              max={31}
              value={choice.bit}
              onChange={(bit) => bit !== null && onChange({ ...choice, bit })}
            />
          )}
          <NativeSelect
            label={t('trigger.before')}
            value={String(choice.before)}
            onChange={(event) => onChange({ ...choice, before: Number(event.currentTarget.value) })}
            data={[0, 0.1, 0.2, 0.5, 0.8].map((part) => ({
              value: String(part),
              label: `${part * 100} %`,
            }))}
          />
          <NativeSelect
            label={t('trigger.persistence')}
            value={String(persistence)}
            onChange={(event) => onPersistence(Number(event.currentTarget.value))}
            data={[0, 3, 10, 30].map((sweeps) => ({
              value: String(sweeps),
              label: sweeps ? t('trigger.sweeps', { count: sweeps }) : t('trigger.none'),
            }))}
          />
          <Button disabled={gone} onClick={onArm}>
            {t('trigger.arm')}
          </Button>
          {state && !gone && (
            <strong className={`trigger-state ${state.state}`} role="status">
              {t(`trigger.state.${state.state}`, { count: state.count })}
            </strong>
          )}
        </>
      )}
    </div>
  )
}
