import { Button, NativeSelect } from '@mantine/core'
import { useT } from '../../../i18n'
import type { Span } from '../../../plots/geometry/yscale'
import { figure } from '../../../widgets/numbers/format'
import { NumberField } from '../../../widgets/numbers/NumberField'

/** The y scale of each unit: following the traces, or fixed between two numbers. */
export function RangePanel({
  units,
  ranges,
  now,
  onRange,
  onFit,
}: {
  units: string[]
  ranges: ReadonlyMap<string, Span>
  /** What a unit's scale shows at the moment. */
  now: (unit: string) => Span | null
  onRange: (unit: string, range: Span | null) => void
  /** All of them follow again. */
  onFit: () => void
}) {
  const t = useT()
  const nameOf = (unit: string) => unit || t('scale.noUnit')
  const words = units.map((unit) => {
    const range = ranges.get(unit)
    const what = range ? `${figure(range.min)} … ${figure(range.max)}` : t('scale.auto')
    return `${nameOf(unit)}: ${what}`
  })
  return (
    <details className="scales">
      <summary>
        {t('scale.title')}{' '}
        <span className="dim num">
          {ranges.size === 0 ? t('scale.allAuto') : words.join(' · ')}
        </span>
      </summary>
      <div className="row wrap">
        {units.map((unit) => {
          const range = ranges.get(unit)
          const name = nameOf(unit)
          return (
            <fieldset key={unit} className="row wrap scale">
              <NativeSelect
                label={name}
                value={range ? 'fixed' : 'auto'}
                onChange={(event) =>
                  onRange(
                    unit,
                    event.currentTarget.value === 'fixed'
                      ? (now(unit) ?? { min: -1, max: 1 })
                      : null,
                  )
                }
                data={(['auto', 'fixed'] as const).map((value) => ({
                  value,
                  label: t(`scale.${value}`),
                }))}
              />
              {range && (
                <>
                  <NumberField
                    label={t('scale.low', { unit: name })}
                    value={range.min}
                    below={range.max}
                    onChange={(min) => min !== null && onRange(unit, { ...range, min })}
                  />
                  <NumberField
                    label={t('scale.high', { unit: name })}
                    value={range.max}
                    above={range.min}
                    onChange={(max) => max !== null && onRange(unit, { ...range, max })}
                  />
                </>
              )}
            </fieldset>
          )
        })}
        <Button disabled={ranges.size === 0} onClick={onFit}>
          {t('scale.fit')}
        </Button>
      </div>
      <p className="dim">{t('scale.help')}</p>
    </details>
  )
}
