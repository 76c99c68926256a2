import { useT } from '../../../i18n'
import { NumberField } from '../../../widgets/numbers/NumberField'
import type { Typed } from './useMotionNumbers'

/** Units of an axis by quantity, as its state shows them. */
type Units = Record<string, string>

interface Field extends Typed {
  units: Units
  optional?: boolean
  disabled?: boolean
}

/** How far the axis may go from where it is. */
export function TravelLimit({ units, ...field }: Field) {
  const t = useT()
  return (
    <NumberField label={t('motion.travelLimit')} unit={units.position ?? ''} above={0} {...field} />
  )
}

/** Torque that the drive is limited to, in per cent of the rated one. */
export function TorqueLimit(field: Omit<Field, 'units'>) {
  const t = useT()
  return <NumberField label={t('motion.torqueLimit')} unit="%" above={0} max={400} {...field} />
}

/** Speed of a motion; `label` where it is a limit and not the speed itself. */
export function Speed({ units, label, ...field }: Field & { label?: string }) {
  const t = useT()
  return (
    <NumberField
      label={label ?? t('motion.speed')}
      unit={units.velocity ?? ''}
      above={0}
      {...field}
    />
  )
}

/** Acceleration and, where nothing else is asked, deceleration. */
export function Acceleration({ units, ...field }: Field) {
  const t = useT()
  return (
    <NumberField
      label={t('motion.acceleration')}
      unit={units.acceleration ?? ''}
      above={0}
      {...field}
    />
  )
}

/** What will move, within the limits that are typed: next to every button that starts it. */
export function MovesByItself({
  units,
  travel,
  torque,
}: {
  units: Units
  travel: number | null
  torque: number | null
}) {
  const t = useT()
  // A field that is being typed in moves nothing below it.
  return (
    <p className="note warn">
      {t('motion.moves', {
        travel: travel ?? '…',
        unit: units.position ?? '',
        torque: torque ?? '…',
      })}
    </p>
  )
}
