import type { SegmentExchange } from '../../../api/schema'
import { useT } from '../../../i18n'
import { barHeight, shownBins } from './layout'

const BAR = 46
const HEIGHT = 90
const FOOT = 18
const HEAD = 16

/** How late cycles began, and what became of their frames. */
export function Lateness({ exchange }: { exchange: SegmentExchange }) {
  const t = useT()
  const bins = shownBins(exchange.late)
  const most = Math.max(...bins.map((bin) => bin.count), 1)
  const width = exchange.late.length * BAR
  const figures: [string, string, boolean][] = [
    [t('segment.cycles'), String(exchange.cycles), false],
    [t('segment.overruns'), String(exchange.overruns), exchange.overruns > 0],
    [t('quality.lost_frames'), String(exchange.lost_frames), exchange.lost_frames > 0],
    [t('quality.wkc_errors'), String(exchange.wkc_errors), exchange.wkc_errors > 0],
    [
      t('segment.wkc'),
      `${exchange.last_wkc} / ${exchange.expected_wkc}`,
      exchange.last_wkc !== exchange.expected_wkc,
    ],
    [t('segment.late50'), `< ${exchange.late_p50_us} µs`, false],
    [t('segment.late99'), `< ${exchange.late_p99_us} µs`, false],
    [t('segment.lateMax'), `${exchange.late_max_us} µs`, false],
  ]
  if (exchange.dc) {
    figures.push([t('segment.dcNow'), `${exchange.dc_deviation_ns} ns`, false])
    figures.push([t('segment.dcMax'), `${exchange.dc_deviation_max_ns} ns`, false])
  }
  return (
    <>
      <dl className="counters">
        {figures.map(([name, value, warn]) => (
          <div key={name} className={warn ? 'warn-text' : ''}>
            <dt>{name}</dt>
            <dd className="num">{value}</dd>
          </div>
        ))}
      </dl>
      <figure className="lateness">
        <figcaption className="dim">{t('segment.histogram')}</figcaption>
        <svg
          viewBox={`0 0 ${width} ${HEAD + HEIGHT + FOOT}`}
          aria-label={t('segment.histogram')}
          style={{ maxWidth: width * 1.2 }}
        >
          <title>{t('segment.histogram')}</title>
          {bins.map((bin, place) => {
            const height = barHeight(bin.count, most) * HEIGHT
            const x = place * BAR
            return (
              <g key={bin.below_us ?? 'above'}>
                <rect x={x + 2} y={HEAD + HEIGHT - height} width={BAR - 4} height={height} />
                {bin.count > 0 && (
                  <text x={x + BAR / 2} y={HEAD + HEIGHT - height - 3}>
                    {amount(bin.count)}
                  </text>
                )}
                <text x={x + BAR / 2} y={HEAD + HEIGHT + 13}>
                  {bin.below_us === null ? '>' : `<${time(bin.below_us)}`}
                </text>
              </g>
            )
          })}
        </svg>
      </figure>
    </>
  )
}

function amount(count: number): string {
  if (count < 1000) return String(count)
  return count < 1e6 ? `${Math.round(count / 1e3)}k` : `${(count / 1e6).toFixed(1)}M`
}

function time(microseconds: number): string {
  return microseconds < 1000 ? `${microseconds}µs` : `${Math.round(microseconds / 1000)}ms`
}
