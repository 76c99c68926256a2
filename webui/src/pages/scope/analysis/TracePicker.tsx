import { NativeSelect } from '@mantine/core'
import { useT } from '../../../i18n'
import type { Shown } from '../setup/setup'

export function TracePicker({
  shown,
  value,
  label,
  onChange,
}: {
  shown: Shown[]
  value: string
  label?: string
  onChange: (id: string) => void
}) {
  const t = useT()
  return (
    <NativeSelect
      label={label ?? t('scope.trace')}
      value={value}
      onChange={(event) => onChange(event.currentTarget.value)}
      data={shown.map((each) => ({ value: each.id, label: `${each.id} ${each.label}` }))}
    />
  )
}
