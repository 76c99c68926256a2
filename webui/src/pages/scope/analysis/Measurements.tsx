import { useT } from '../../../i18n'
import type { Measurement } from '../../../live/scope/analysis/measure'
import type { ScopeFrame } from '../../../live/worker/worker-messages'
import { figure } from '../../../widgets/numbers/format'
import type { Shown } from '../setup/setup'

/** Older than this counts as “nothing comes”. */
const SILENT_S = 1

const FIGURES: { name: string; of: (m: Measurement) => number | null; step?: boolean }[] = [
  { name: 'min', of: (m) => m.min },
  { name: 'max', of: (m) => m.max },
  { name: 'mean', of: (m) => m.mean },
  { name: 'rms', of: (m) => m.rms },
  { name: 'pp', of: (m) => m.peakToPeak },
  { name: 'rise', of: (m) => scaled(m.riseTime, 1000), step: true },
  { name: 'overshoot', of: (m) => m.overshoot, step: true },
  { name: 'settling', of: (m) => scaled(m.settling, 1000), step: true },
  { name: 'frequency', of: (m) => m.frequency },
]

const scaled = (value: number | null, by: number) => (value === null ? null : value * by)

/** Figures per trace from the raw samples, and how exact each trace's times are. */
export function Measurements({
  frame,
  shown,
  colors,
  cursors,
}: {
  frame: ScopeFrame | null
  shown: Shown[]
  colors: string[]
  cursors: number[]
}) {
  const t = useT()
  const [a] = cursors
  return (
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
            <th>{t('scope.timing')}</th>
            {a !== undefined && (
              <>
                <th className="right">A</th>
                <th className="right">B</th>
                <th className="right">B−A</th>
              </>
            )}
            {FIGURES.map(({ name }) => (
              <th key={name} className="right">
                {t(`measure.${name}` as 'measure.min')}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {shown.map((each, i) => {
            const m = frame?.measurements?.[i] ?? null
            const atA = frame?.cursorValues[0]?.[i] ?? null
            const atB = frame?.cursorValues[1]?.[i] ?? null
            return (
              <tr key={each.id} data-trace={each.id}>
                <td className="trace-name">
                  <span className="swatch" style={{ background: colors[i] }} />{' '}
                  <span className="dim num">{each.id}</span> {each.label}
                </td>
                <td className="unit">{each.unit}</td>
                <td className="dim num timing">
                  <Timing frame={frame} i={i} shown={each} />
                </td>
                {a !== undefined && (
                  <>
                    <td className="num right" data-figure="a">
                      {figure(atA)}
                    </td>
                    <td className="num right" data-figure="b">
                      {figure(atB)}
                    </td>
                    <td className="num right" data-figure="ba">
                      {atA === null || atB === null ? '—' : figure(atB - atA)}
                    </td>
                  </>
                )}
                {FIGURES.map(({ name, of, step }) => (
                  <td key={name} className="num right" data-figure={name}>
                    {step && m && m.riseTime === null ? (
                      <span className="dim">{t('measure.noStep')}</span>
                    ) : (
                      figure(m && of(m))
                    )}
                  </td>
                ))}
              </tr>
            )
          })}
        </tbody>
      </table>
    </div>
  )
}

function Timing({ frame, i, shown }: { frame: ScopeFrame | null; i: number; shown: Shown }) {
  const t = useT()
  const rate = frame?.rates[i] ?? null
  const age = frame?.ages[i] ?? 0
  const silent = frame?.silent[i] ?? 0
  const invalid =
    frame !== null && frame.measurements !== null && !frame.measurements[i] && rate !== null
  return (
    <>
      {shown.computed && t('scope.computed')}
      {shown.synchronous !== null && t(shown.synchronous ? 'scope.synchronous' : 'scope.polled')}
      {rate !== null && ` ${figure(rate, 3)}/s`}
      {age > 0.2 && silent <= SILENT_S && ` · ${t('scope.age', { age: figure(age, 2) })}`}
      {silent > SILENT_S ? (
        <strong className="warn-text"> {t('scope.silent', { age: figure(silent, 2) })}</strong>
      ) : (
        invalid && <strong className="warn-text"> {t('scope.invalid')}</strong>
      )}
    </>
  )
}
