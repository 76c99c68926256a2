import { useT } from '../../../i18n'
import { figure } from '../../../widgets/numbers/format'
import { NumberField } from '../../../widgets/numbers/NumberField'

/** The cursors' times as numbers, for the keyboard and for exact places. */
export function Cursors({
  cursors,
  origin,
  onCursor,
}: {
  cursors: number[]
  origin: number
  onCursor: (index: number, time: number) => void
}) {
  const t = useT()
  const [a, b] = cursors
  if (a === undefined || b === undefined) return null
  return (
    <div className="row wrap cursors">
      {[a, b].map((time, i) => (
        <NumberField
          key={i}
          label={t('scope.cursor', { name: 'AB'[i] as string })}
          unit="s"
          value={Number((time - origin).toFixed(7))}
          onChange={(value) => value !== null && onCursor(i, value + origin)}
        />
      ))}
      <p className="num" role="status">
        {t('scope.between', { time: figure(Math.abs(b - a), 6) })}
        {b !== a && ` · 1/Δt = ${figure(1 / Math.abs(b - a), 5)} Hz`}
      </p>
    </div>
  )
}
