import { Button } from '@mantine/core'
import { useState } from 'react'
import { known, useT } from '../../../i18n'
import { fixed, hertz } from '../../response/plot/bode'
import type { Candidate } from '../../response/results'

/** The marked designs, or all of them, fastest first; `onApply` writes one of them. */
export function CandidateTable({
  candidates,
  onApply,
}: {
  candidates: Candidate[]
  onApply: ((candidate: Candidate) => void) | null
}) {
  const t = useT()
  const marked = candidates.filter((each) => each.marks.length > 0)
  const [all, setAll] = useState(marked.length === 0)
  if (candidates.length === 0) return <p className="note warn">{t('candidate.none')}</p>
  return (
    <>
      <div className="scroll-table">
        <table className="designs" aria-label={t('candidate.title')}>
          <thead>
            <tr>
              <th>{t('candidate.mark')}</th>
              {onApply && <th />}
              <th className="right">{t('margin.bandwidth')}</th>
              <th className="right">{t('gain.speed')}</th>
              <th className="right">{t('gain.position')}</th>
              <th className="right">{t('margin.gain')}</th>
              <th className="right">{t('margin.phase')}</th>
              <th className="right">{t('margin.ms')}</th>
              <th className="right">{t('candidate.settling')}</th>
              <th className="right">{t('candidate.overshoot')}</th>
              <th className="right">{t('candidate.cost')}</th>
              <th>{t('notch.title')}</th>
            </tr>
          </thead>
          <tbody className="num">
            {(all ? candidates : marked).map((each, i) => (
              <tr key={i} className={each.marks.length > 0 ? 'marked' : ''}>
                <td>
                  <strong>{each.marks.map((mark) => known(t, 'mark', mark)).join(', ')}</strong>
                </td>
                {onApply && (
                  <td>
                    <Button onClick={() => onApply(each)}>{t('candidate.apply')}</Button>
                  </td>
                )}
                <td className="right">{hertz(each.bandwidth_hz)}</td>
                <td className="right">{hertz(each.gains.speed_bandwidth_hz)}</td>
                <td className="right">{fixed(each.gains.position_1_s, 0, '1/s')}</td>
                <td className="right">{fixed(each.promised.gain_margin_db, 1, 'dB')}</td>
                <td className="right">{fixed(each.promised.phase_margin_deg, 0, '°')}</td>
                <td className="right">{fixed(each.promised.ms, 2)}</td>
                <td className="right">
                  {fixed(each.settling_s === null ? null : each.settling_s * 1000, 1, 'ms')}
                </td>
                <td className="right">{fixed(each.overshoot_percent, 0, '%')}</td>
                <td className="right">{fixed(Math.abs(each.phase_cost_deg), 0, '°')}</td>
                <td>
                  {each.notches.length === 0
                    ? '—'
                    : each.notches.map((notch) => hertz(notch.center_hz)).join(', ')}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {marked.length > 0 && marked.length < candidates.length && (
        <Button onClick={() => setAll(!all)} aria-expanded={all}>
          {all ? t('candidate.marked') : t('candidate.all', { count: candidates.length })}
        </Button>
      )}
    </>
  )
}
