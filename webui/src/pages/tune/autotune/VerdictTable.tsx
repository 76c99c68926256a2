import { useT } from '../../../i18n'
import { fixed, hertz } from '../../response/plot/bode'
import type { BandVerdict, Interval, Verdict } from '../../response/results'

/** Margins of the tuned loop by band: where it was measured, and where it is predicted. */
export function VerdictTable({ verdict }: { verdict: Verdict }) {
  const t = useT()
  const rows: [string, BandVerdict][] = []
  if (verdict.measured) rows.push([t('verdict.measured'), verdict.measured])
  if (verdict.predicted) rows.push([t('verdict.predicted'), verdict.predicted])
  return (
    <>
      <div className="scroll-table">
        <table>
          <thead>
            <tr>
              <th>{t('verdict.band')}</th>
              <th className="right">{t('margin.phase')}</th>
              <th className="right">{t('margin.gain')}</th>
              <th className="right">{t('verdict.peak')}</th>
            </tr>
          </thead>
          <tbody className="num">
            {rows.map(([name, band]) => (
              <tr key={name}>
                <td>
                  {name}, {hertz(band.low_hz)} – {hertz(band.high_hz)}
                </td>
                <td className="right">{interval(band.phase_margin_deg, 0, '°')}</td>
                <td className="right">{interval(band.gain_margin_db, 1, 'dB')}</td>
                <td className="right">{interval(band.peak_sensitivity, 2)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      <p className="dim">
        {t(`verdict.coverage.${verdict.coverage}`, {
          last: hertz(verdict.last_crossover_hz),
          gain: fixed(verdict.shown_gain_db, 1, 'dB'),
        })}
      </p>
    </>
  )
}

const interval = (of: Interval | null, digits: number, unit?: string) =>
  of === null
    ? '—'
    : `${fixed(of.value, digits, unit)} (${fixed(of.low, digits)} – ${fixed(of.high, digits)})`
