import { Button, NativeSelect } from '@mantine/core'
import { useState } from 'react'
import type { AxisState, InertiaRequest } from '../../../api/schema'
import { useT } from '../../../i18n'
import { NumberField } from '../../../widgets/numbers/NumberField'

const SCHEMES = ['free', 'limited', 'taught'] as const
type Scheme = InertiaRequest['scheme']

/** How an axis may travel while its inertia is found, with taught ends where they are needed. */
export function useScheme() {
  const [scheme, setScheme] = useState<Scheme>('free')
  const [low, setLow] = useState<number | null>(null)
  const [high, setHigh] = useState<number | null>(null)
  const ends: [number, number] | null =
    scheme === 'taught' && low !== null && high !== null && low < high ? [low, high] : null
  const complete = scheme !== 'taught' || ends !== null
  return { scheme, setScheme, low, setLow, high, setHigh, ends, complete }
}

export function SchemeFields({
  of,
  state,
}: {
  of: ReturnType<typeof useScheme>
  state: AxisState | null
}) {
  const t = useT()
  const here = state?.fresh && state.units.position === 'rev' ? state.position : null
  return (
    <>
      <NativeSelect
        label={t('inertia.scheme')}
        description={t(`inertia.help.${of.scheme}`)}
        value={of.scheme}
        onChange={(event) => of.setScheme(event.currentTarget.value as Scheme)}
        data={SCHEMES.map((each) => ({ value: each, label: t(`inertia.scheme.${each}`) }))}
      />
      {of.scheme === 'taught' && (
        <div className="fields">
          {(['low', 'high'] as const).map((end) => (
            <div key={end} className="with-button">
              <NumberField
                label={t(`inertia.end.${end}`)}
                unit="rev"
                value={of[end]}
                onChange={end === 'low' ? of.setLow : of.setHigh}
              />
              {here != null && (
                <Button
                  onClick={() => (end === 'low' ? of.setLow : of.setHigh)(Number(here.toFixed(4)))}
                >
                  {t('sequence.here')}
                </Button>
              )}
            </div>
          ))}
          {of.low !== null && of.high !== null && of.low >= of.high && (
            <p className="fault-text">{t('inertia.endsWrong')}</p>
          )}
        </div>
      )}
    </>
  )
}
