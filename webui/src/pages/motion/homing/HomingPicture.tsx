import type { HomingMethodInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ArrowTip } from '../../../widgets/layout/drawn'

const LEFT = 30
const RIGHT = 410
const RAIL = 78
const INDEX_STEP = 38

/**
 * What the axis does in a homing method: where it goes first, which signal turns it round, and
 * where zero comes to lie. Right is the positive direction. Drawn from the profile's facts, so
 * it says no more than they do.
 */
export function HomingPicture({ method, name }: { method: HomingMethodInfo; name: string }) {
  const t = useT()
  const positive = method.direction === 'positive'
  const moves = method.direction !== 'none'
  const end = positive ? RIGHT - 34 : LEFT + 34
  const middle = 220
  const signalAt = method.signal === 'home' ? middle + (positive ? 60 : -60) : end
  const begin = positive ? LEFT + 80 : RIGHT - 80
  const backTo = nearestPulse(signalAt + (positive ? -INDEX_STEP : INDEX_STEP))
  const signal = ['limit', 'home', 'torque'].includes(method.signal)
  const zeroAt =
    method.signal === 'current_position' || !moves
      ? middle
      : method.uses_index
        ? signal
          ? backTo
          : nearestPulse(begin + (positive ? 2 : -2) * INDEX_STEP)
        : signalAt
  const startAt = method.signal === 'current_position' || !moves ? middle : begin
  const path =
    !moves || method.signal === 'current_position'
      ? null
      : signal
        ? `M${startAt} 40H${signalAt}${zeroAt !== signalAt ? `V58H${zeroAt}` : ''}`
        : `M${startAt} 40H${zeroAt}`
  return (
    <svg className="homing-picture" viewBox="0 0 440 150" role="img" aria-label={name}>
      <title>{name}</title>
      <ArrowTip id="home-tip" />
      <line x1={LEFT} y1={RAIL} x2={RIGHT} y2={RAIL} className="rail" />
      <text x={LEFT} y={RAIL + 18} className="label">
        −
      </text>
      <text x={RIGHT - 8} y={RAIL + 18} className="label">
        +
      </text>
      <rect x={startAt - 17} y={RAIL - 14} width={34} height={14} className="carriage" />
      {method.uses_index && <IndexTrack label={t('homing.index')} />}
      {(method.signal === 'limit' || method.uses_limit) && (
        <g className="switch">
          <rect x={end - 7} y={RAIL + 4} width={14} height={14} />
          <text x={end} y={RAIL + 32}>
            {t('homing.limit')}
          </text>
        </g>
      )}
      {method.signal === 'home' && (
        <g className="switch">
          <rect x={signalAt - 7} y={RAIL + 4} width={14} height={14} />
          <text x={signalAt} y={RAIL + 32}>
            {t('homing.home')}
          </text>
        </g>
      )}
      {method.signal === 'torque' && (
        <g className="wall">
          <rect x={positive ? end + 17 : end - 25} y={RAIL - 30} width={8} height={42} />
          <text x={end} y={RAIL + 32}>
            {t('homing.stop')}
          </text>
        </g>
      )}
      {path && <path d={path} className="travel" markerEnd="url(#home-tip)" />}
      <g className="zero">
        <line x1={zeroAt} y1={RAIL - 44} x2={zeroAt} y2={RAIL + 6} />
        <text x={zeroAt} y={18}>
          {t('homing.zero')}
        </text>
      </g>
    </svg>
  )
}

const FIRST_PULSE = LEFT + 26
const nearestPulse = (x: number) =>
  FIRST_PULSE + INDEX_STEP * Math.round((x - FIRST_PULSE) / INDEX_STEP)

function IndexTrack({ label }: { label: string }) {
  const pulses = []
  for (let x = FIRST_PULSE; x < RIGHT - 8; x += INDEX_STEP) pulses.push(x)
  return (
    <g className="index">
      <path
        d={`M${LEFT} 138${pulses.map((x) => `H${x - 3}V126H${x + 3}V138`).join('')}H${RIGHT}`}
      />
      <text x={LEFT} y={122}>
        {label}
      </text>
    </g>
  )
}
