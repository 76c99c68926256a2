import { SegmentedControl } from '@mantine/core'
import { useT } from '../../i18n'
import { NumberField } from '../../widgets/numbers/NumberField'
import type { Form } from './mechanics'

/** The dimensions that the chosen kind of mechanics has. `resolution` only where a gear is planned. */
export function MechanicsFields({
  form,
  change,
  resolution = true,
}: {
  form: Form
  change: (part: Partial<Form>) => void
  resolution?: boolean
}) {
  const t = useT()
  const unit = form.kind === 'rotary' ? '°' : 'mm'
  const number = (
    name: 'lead_mm' | 'diameter_mm' | 'pitch_mm' | 'module_mm' | 'resolution',
    label: string,
    of = 'mm',
  ) => (
    <NumberField
      label={label}
      unit={of}
      value={form[name]}
      onChange={(value) => change({ [name]: value })}
      above={0}
    />
  )
  const count = (name: 'teeth' | 'motor_turns' | 'load_turns', label: string) => (
    <NumberField
      label={label}
      value={form[name]}
      onChange={(value) => change({ [name]: value })}
      min={1}
      max={100000}
      integer
    />
  )
  const ways = { belt: ['diameter', 'teeth'], rack: ['module', 'pitch'] } as const
  const way = form.kind === 'belt' ? form.belt : form.rack
  return (
    <>
      {(form.kind === 'belt' || form.kind === 'rack') && (
        <SegmentedControl
          value={way}
          onChange={(next) =>
            change(
              form.kind === 'belt'
                ? { belt: next as Form['belt'] }
                : { rack: next as Form['rack'] },
            )
          }
          data={ways[form.kind].map((value) => ({ value, label: t(`gear.by.${value}`) }))}
        />
      )}
      <div className="fields">
        {form.kind === 'screw' && number('lead_mm', t('gear.lead'))}
        {form.kind === 'belt' &&
          form.belt === 'diameter' &&
          number('diameter_mm', t('gear.diameter'))}
        {((form.kind === 'belt' && form.belt === 'teeth') ||
          (form.kind === 'rack' && form.rack === 'pitch')) &&
          number('pitch_mm', t('gear.pitch'))}
        {form.kind === 'rack' && form.rack === 'module' && number('module_mm', t('gear.module'))}
        {(form.kind === 'rack' || (form.kind === 'belt' && form.belt === 'teeth')) &&
          count('teeth', t('gear.teeth'))}
        {count('motor_turns', t('gear.motorTurns'))}
        {count('load_turns', t('gear.loadTurns'))}
        {resolution && number('resolution', t('gear.resolution'), unit)}
      </div>
    </>
  )
}
