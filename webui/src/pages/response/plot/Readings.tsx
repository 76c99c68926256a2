import { Button } from '@mantine/core'
import { type Key, useT } from '../../../i18n'
import { fixed, hertz, nearest, wrapWhole } from './bode'
import type { Margins, Sweep } from '../results'

/** The curve's values under both cursors, and their difference. */
export function CursorTable({
  sweep,
  over,
  cursors,
}: {
  sweep: Sweep
  over: Sweep | null
  cursors: [number, number]
}) {
  const t = useT()
  const at = (each: Sweep, f: number) => {
    const i = nearest(each.frequency_hz, f)
    return {
      f: each.frequency_hz[i],
      db: each.magnitude_db[i] ?? null,
      // By the same turns as the curve is drawn.
      deg: wrapWhole(each.phase_deg, each.frequency_hz)[i] ?? null,
      spread: each.std_db[i] ?? null,
      coherence: each.coherence[i] ?? null,
    }
  }
  const rows = cursors.map((f) => ({ now: at(sweep, f), other: over ? at(over, f) : null }))
  const [a, b] = rows
  const minus = (x?: number | null, y?: number | null) =>
    x === null || y === null || x === undefined || y === undefined ? null : y - x
  return (
    <div className="scroll-table">
      <table>
        <thead>
          <tr>
            <th>{t('cursor.title')}</th>
            <th className="right">{t('cursor.frequency')}</th>
            <th className="right">{t('cursor.magnitude')}</th>
            <th className="right">±</th>
            <th className="right">{t('cursor.phase')}</th>
            <th className="right">{t('cursor.coherence')}</th>
            {over && <th className="right">{t('cursor.other')}</th>}
          </tr>
        </thead>
        <tbody className="num">
          {rows.map(({ now, other }, i) => (
            <tr key={i}>
              <td>{'AB'[i]}</td>
              <td className="right">{hertz(now.f)}</td>
              <td className="right">{fixed(now.db, 2, 'dB')}</td>
              <td className="right">
                {now.spread === null ? '—' : fixed(1.96 * now.spread, 2, 'dB')}
              </td>
              <td className="right">{fixed(now.deg, 1, '°')}</td>
              <td className="right">{fixed(now.coherence, 3)}</td>
              {over && (
                <td className="right">
                  {fixed(other?.db, 2, 'dB')} · {fixed(other?.deg, 1, '°')}
                </td>
              )}
            </tr>
          ))}
          <tr>
            <td>B−A</td>
            <td className="right">{hertzOf(minus(a?.now.f, b?.now.f))}</td>
            <td className="right">{fixed(minus(a?.now.db, b?.now.db), 2, 'dB')}</td>
            <td />
            <td className="right">{fixed(minus(a?.now.deg, b?.now.deg), 1, '°')}</td>
            <td />
            {over && <td />}
          </tr>
        </tbody>
      </table>
    </div>
  )
}

const hertzOf = (f: number | null) => (f === null ? '—' : f < 0 ? `−${hertz(-f)}` : hertz(f))

const percentBand = ([low, high]: [number, number]) =>
  `(${fixed(low * 100, 1, '')}…${fixed(high * 100, 1, '%')})`

/** Resonances and antiresonances; `onNotch` puts a notch on a resonance. */
export function ResonanceTable({
  sweep,
  onNotch,
}: {
  sweep: Sweep
  onNotch: ((frequency: number, damping: number, height: number) => void) | null
}) {
  const t = useT()
  if (sweep.resonances.length === 0) return <p className="dim">{t('resonance.none')}</p>
  return (
    <div className="scroll-table">
      <table aria-label={t('resonance.title')}>
        <thead>
          <tr>
            <th>{t('resonance.kind')}</th>
            <th className="right">{t('cursor.frequency')}</th>
            <th className="right">{t('resonance.damping')}</th>
            <th className="right">{t('resonance.height')}</th>
            {onNotch && <th />}
          </tr>
        </thead>
        <tbody className="num">
          {sweep.resonances.map((each) => (
            <tr key={`${each.kind} ${each.frequency_hz}`}>
              <td>{t(`resonance.${each.kind}`)}</td>
              <td className="right">{hertz(each.frequency_hz)}</td>
              <td className="right">
                {fixed(each.damping * 100, 1, '%')}
                {each.damping_ci95 && (
                  <span className="dim"> {percentBand(each.damping_ci95)}</span>
                )}
              </td>
              <td className="right">{fixed(each.height_db, 1, 'dB')}</td>
              {onNotch && (
                <td className="right">
                  {each.kind === 'resonance' && (
                    <Button
                      onClick={() => onNotch(each.frequency_hz, each.damping, each.height_db)}
                    >
                      {t('resonance.notch')}
                    </Button>
                  )}
                </td>
              )}
            </tr>
          ))}
        </tbody>
      </table>
      {sweep.resonances.some((each) => each.damping_ci95) && (
        <p className="dim">{t('resonance.band')}</p>
      )}
    </div>
  )
}

const MARGINS: { key: string; text: Key; show: (value: number) => string; at?: string }[] = [
  { key: 'bandwidth_hz', text: 'margin.bandwidth', show: hertz },
  { key: 'bandwidth_90deg_hz', text: 'margin.bandwidth90', show: hertz },
  { key: 'crossover_hz', text: 'margin.crossover', show: hertz },
  {
    key: 'phase_margin_deg',
    text: 'margin.phase',
    show: (v) => fixed(v, 1, '°'),
    at: 'phase_margin_hz',
  },
  {
    key: 'gain_margin_db',
    text: 'margin.gain',
    show: (v) => fixed(v, 1, 'dB'),
    at: 'gain_margin_hz',
  },
  { key: 'ms', text: 'margin.ms', show: (v) => fixed(v, 2), at: 'ms_hz' },
]

/** Bandwidths and margins of a loop, with the frequencies at which they were read. */
export function MarginList({
  margins,
  over = null,
}: {
  margins: Margins
  /** Those of a loop that it is compared with. */
  over?: Margins | null
}) {
  const t = useT()
  if (Object.keys(margins).length === 0) return null
  return (
    <>
      {margins.stable === false && <p className="note fault">{t('margin.unstable')}</p>}
      <dl className="counters">
        {MARGINS.map(({ key, text, show, at }) => {
          const value = margins[key]
          const where = at === undefined ? null : margins[at]
          return (
            <div key={key}>
              <dt>{t(text)}</dt>
              <dd className="num">
                {typeof value === 'number' ? show(value) : '—'}
                {typeof value === 'number' && typeof where === 'number' && (
                  <small className="dim"> {t('margin.at', { frequency: hertz(where) })}</small>
                )}
                {over && (
                  <small className="dim">
                    {' '}
                    {t('margin.before', {
                      value: typeof over[key] === 'number' ? show(over[key]) : '—',
                    })}
                  </small>
                )}
              </dd>
            </div>
          )
        })}
      </dl>
    </>
  )
}
