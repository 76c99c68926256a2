import { useT } from '../../../i18n'
import { figure } from '../../../widgets/numbers/format'
import { fixed, hertz } from '../plot/bode'
import { axisOf, importedOf } from './imports'
import type { ImportedAxis, Sweep } from '../results'

/** How an import was evaluated, and what was concluded of the axis where its structure is stated. */
export function ImportedFacts({ sweep }: { sweep: Sweep }) {
  const t = useT()
  const facts = importedOf(sweep)
  const axis = axisOf(sweep)
  if (!facts) return null
  return (
    <>
      <p>
        {t(`import.found.${facts.excitation}`, {
          period: figure(facts.period_s ?? 0, 6),
          used: sweep.periods_used ?? 0,
          left: facts.transient_periods,
        })}{' '}
        <span className="dim">{t('import.band')}</span>
      </p>
      {axis?.verdict === 'sound' && axis.inertia !== undefined && (
        <>
          <p>
            {t('import.inertia', {
              value: figure(axis.inertia, 4),
              low: figure(axis.inertia_ci95?.[0] ?? 0, 4),
              high: figure(axis.inertia_ci95?.[1] ?? 0, 4),
              unit: axis.inertia_unit ?? '',
              viscous: figure(axis.viscous ?? 0, 3),
              viscousUnit: axis.viscous_unit ?? '',
            })}
          </p>
          <Candidates axis={axis} />
        </>
      )}
    </>
  )
}

function Candidates({ axis }: { axis: ImportedAxis }) {
  const t = useT()
  const rows = axis.candidates ?? []
  if (rows.length === 0) return null
  return (
    <>
      <h3>{t('import.candidates')}</h3>
      <div className="scroll-table">
        <table>
          <thead>
            <tr>
              <th />
              <th className="right">{t('import.gain')}</th>
              <th className="right">{t('import.integral')}</th>
              <th>{t('import.notches')}</th>
              <th className="right">{t('import.margin')}</th>
            </tr>
          </thead>
          <tbody className="num">
            {rows.map((each) => (
              <tr key={each.marks.join()}>
                <td>
                  {each.marks
                    .map((mark) =>
                      mark === 'robust' || mark === 'balanced' || mark === 'fast'
                        ? t(`import.mark.${mark}`)
                        : mark,
                    )
                    .join(', ')}
                </td>
                <td className="right">
                  {figure(each.gains.speed_nms, 4)} {axis.viscous_unit}
                </td>
                <td className="right">{hertz(each.gains.integral_hz)}</td>
                <td>
                  {each.notches
                    .map((notch) => `${hertz(notch.center_hz)} ${fixed(notch.depth_db, 0, 'dB')}`)
                    .join(', ') || '—'}
                </td>
                <td className="right">{fixed(each.promised.phase_margin_deg, 0, '°')}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  )
}
