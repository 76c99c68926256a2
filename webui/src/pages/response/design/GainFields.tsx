import type { GainValues } from '../../../api/schema'
import { useT } from '../../../i18n'
import { NumberField } from '../../../widgets/numbers/NumberField'

export type PartialGains = { [name in keyof GainValues]: number | null }

/** All gains, or null while one is missing. */
export function whole(gains: PartialGains): GainValues | null {
  const { speed_bandwidth_hz, integral_hz, position_1_s, inertia_kgm2 } = gains
  return speed_bandwidth_hz === null ||
    integral_hz === null ||
    position_1_s === null ||
    inertia_kgm2 === null
    ? null
    : { speed_bandwidth_hz, integral_hz, position_1_s, inertia_kgm2 }
}

/** Loop gains in physical units. */
export function GainFields({
  gains,
  onChange,
}: {
  gains: PartialGains
  onChange: (gains: PartialGains) => void
}) {
  const t = useT()
  return (
    <div className="fields">
      <NumberField
        label={t('gain.speed')}
        unit="Hz"
        value={gains.speed_bandwidth_hz}
        above={0}
        onChange={(value) => onChange({ ...gains, speed_bandwidth_hz: value })}
      />
      <NumberField
        label={t('gain.integral')}
        unit="Hz"
        value={gains.integral_hz}
        above={0}
        onChange={(value) => onChange({ ...gains, integral_hz: value })}
      />
      <NumberField
        label={t('gain.position')}
        unit="1/s"
        value={gains.position_1_s}
        above={0}
        onChange={(value) => onChange({ ...gains, position_1_s: value })}
      />
      <NumberField
        label={t('gain.inertia')}
        unit="kg·m²"
        value={gains.inertia_kgm2}
        above={0}
        onChange={(value) => onChange({ ...gains, inertia_kgm2: value })}
      />
    </div>
  )
}
