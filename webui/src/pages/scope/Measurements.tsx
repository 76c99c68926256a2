import { useT } from '../../i18n'
import type { ScopeFrame } from '../../live/worker-messages'
import type { PlotSeries } from '../../plots/TimePlot'
import { figure } from '../../widgets/format'

/** Figures per trace from the raw samples, and how honest each trace's times are. */
export function Measurements({
  frame,
  series,
  synchronous,
  cursors,
}: {
  frame: ScopeFrame | null
  series: PlotSeries[]
  synchronous: (boolean | null)[]
  cursors: number[]
}) {
  const t = useT()
  const [a, b] = cursors
  return (
    <>
      <div
        className="scroll-table measurements"
        role="region"
        aria-label={t('scope.measurements')}
        tabIndex={0}
      >
        <table>
          <thead>
            <tr>
              <th>{t('scope.trace')}</th>
              <th>{t('column.unit')}</th>
              {(['min', 'max', 'mean', 'rms', 'pp'] as const).map((name) => (
                <th key={name} className="right">
                  {t(`measure.${name}`)}
                </th>
              ))}
              {a !== undefined && (
                <>
                  <th className="right">A</th>
                  <th className="right">B</th>
                  <th className="right">B−A</th>
                </>
              )}
              <th>{t('scope.timing')}</th>
            </tr>
          </thead>
          <tbody>
            {series.map((each, i) => {
              const m = frame?.measurements[i] ?? null
              const atA = frame?.cursorValues[0]?.[i] ?? null
              const atB = frame?.cursorValues[1]?.[i] ?? null
              return (
                <tr key={i}>
                  <td>
                    <span className="swatch" style={{ background: each.color }} /> {each.label}
                  </td>
                  <td className="unit">{each.unit}</td>
                  <td className="num right">{figure(m?.min)}</td>
                  <td className="num right">{figure(m?.max)}</td>
                  <td className="num right">{figure(m?.mean)}</td>
                  <td className="num right">{figure(m?.rms)}</td>
                  <td className="num right">{figure(m?.peakToPeak)}</td>
                  {a !== undefined && (
                    <>
                      <td className="num right">{figure(atA)}</td>
                      <td className="num right">{figure(atB)}</td>
                      <td className="num right">
                        {atA === null || atB === null ? '—' : figure(atB - atA)}
                      </td>
                    </>
                  )}
                  <td className="dim num">
                    {synchronous[i] === null
                      ? ''
                      : t(synchronous[i] ? 'scope.synchronous' : 'scope.polled')}
                    {frame?.rates[i] != null && ` ${figure(frame.rates[i], 3)}/s`}
                    {frame !== null && m === null && frame.rates[i] !== null && (
                      <strong className="warn-text"> {t('scope.invalid')}</strong>
                    )}
                    {(frame?.ages[i] ?? 0) > 0.2 &&
                      ` · ${t('scope.age', { age: figure(frame?.ages[i], 2) })}`}
                  </td>
                </tr>
              )
            })}
          </tbody>
        </table>
      </div>
      <p className="dim num">
        {a !== undefined && b !== undefined && (
          <>
            {t('scope.between', { time: figure(Math.abs(b - a), 4) })}
            {b !== a && ` · 1/Δt = ${figure(1 / Math.abs(b - a), 4)} Hz`}
            {' · '}
          </>
        )}
        {t('scope.dropped', { count: frame?.dropped ?? 0, blocks: frame?.lostBlocks ?? 0 })}
      </p>
    </>
  )
}
