import { NativeSelect, TextInput } from '@mantine/core'
import type { ScopeTrace } from '../../../api/schema'
import { useT } from '../../../i18n'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { type Infos, infoOf } from './setup'

/** In which unit each chosen channel is shown. */
export function UnitRows({
  traces,
  infos,
  nameOf,
  onChange,
}: {
  traces: ScopeTrace[]
  infos: Infos
  nameOf: (trace: ScopeTrace) => string
  onChange: (traces: ScopeTrace[]) => void
}) {
  const t = useT()
  const change = (i: number, part: Partial<ScopeTrace>) =>
    onChange(traces.map((each, n) => (n === i ? { ...each, ...part } : each)))
  return (
    <>
      {traces.map((trace, i) => {
        const info = infoOf(infos, trace.drive, trace.key)
        const drive = info?.unit || '–'
        return (
          <div className="row wrap unit-row" key={trace.id}>
            <NativeSelect
              className="grow"
              label={`${trace.id} ${nameOf(trace)}`}
              value={trace.show}
              onChange={(event) =>
                change(i, { show: event.currentTarget.value as ScopeTrace['show'] })
              }
              data={[
                ...(info?.axis_unit
                  ? [{ value: 'axis', label: t('scope.unit.axis', { unit: info.axis_unit }) }]
                  : [{ value: 'axis', label: t('scope.unit.drive', { unit: drive }) }]),
                ...(info?.axis_unit
                  ? [{ value: 'drive', label: t('scope.unit.drive', { unit: drive }) }]
                  : []),
                { value: 'own', label: t('scope.unit.own') },
              ]}
            />
            {trace.show === 'own' && (
              <>
                <NumberField
                  label={t('scope.factor', { unit: drive })}
                  value={trace.factor}
                  onChange={(factor) => factor !== null && change(i, { factor })}
                />
                <NumberField
                  label={t('scope.offset')}
                  value={trace.offset}
                  onChange={(offset) => offset !== null && change(i, { offset })}
                />
                <TextInput
                  className="unit-input"
                  label={t('column.unit')}
                  maxLength={20}
                  value={trace.unit}
                  onChange={(event) => change(i, { unit: event.currentTarget.value })}
                />
              </>
            )}
          </div>
        )
      })}
    </>
  )
}
