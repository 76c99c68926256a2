import type { SegmentStation } from '../../../api/schema'
import { useT } from '../../../i18n'
import { type Place, places } from './layout'

const WIDTH = 150
const HEIGHT = 66
const GAP = 96
const ROW = 96
const MARGIN = 8

/** Computer, slaves and the cables between them, as the frames see them. */
export function SegmentPicture({
  stations,
  chosen,
  onChoose,
}: {
  stations: SegmentStation[]
  chosen: number | null
  onChoose: (station: number) => void
}) {
  const t = useT()
  const found = places(stations)
  const columns = Math.max(0, ...found.map((each) => each.column)) + 1
  const rows = Math.max(0, ...found.map((each) => each.row)) + 1
  const width = columns * WIDTH + (columns - 1) * GAP + 2 * MARGIN
  const height = (rows - 1) * ROW + HEIGHT + 2 * MARGIN
  return (
    <div className="segment-scroll">
      <svg
        className="segment-picture"
        viewBox={`0 0 ${width} ${height}`}
        style={{ minWidth: width * 0.75, maxWidth: width * 1.2 }}
        aria-label={t('segment.picture')}
      >
        <title>{t('segment.picture')}</title>
        {found.map((place) => (
          <Cable key={place.station.station} place={place} />
        ))}
        <g>
          <rect x={left(0)} y={top(0)} width={WIDTH} height={HEIGHT} rx={4} />
          <text x={left(0) + WIDTH / 2} y={top(0) + HEIGHT / 2 + 5}>
            {t('segment.computer')}
          </text>
        </g>
        {found.map(({ station, column, row }) => {
          const state = station.answers ? station.state : t('segment.noAnswer')
          const bad = !station.answers || station.error !== ''
          return (
            <g
              key={station.station}
              className={`slave ${bad ? 'bad' : ''} ${station.state === 'OP' ? 'op' : ''}`}
              role="button"
              tabIndex={0}
              aria-pressed={chosen === station.station}
              aria-label={`${station.station} ${station.name}: ${state}`}
              onClick={() => onChoose(station.station)}
              onKeyDown={(event) => {
                if (event.repeat || (event.key !== 'Enter' && event.key !== ' ')) return
                event.preventDefault()
                onChoose(station.station)
              }}
            >
              <rect x={left(column)} y={top(row)} width={WIDTH} height={HEIGHT} rx={4} />
              <text x={left(column) + WIDTH / 2} y={top(row) + 28} className="name">
                {`${station.station} · ${short(station.name)}`}
              </text>
              <text x={left(column) + WIDTH / 2} y={top(row) + 50} className="hint">
                {state}
              </text>
            </g>
          )
        })}
      </svg>
    </div>
  )
}

function Cable({ place }: { place: Place }) {
  const t = useT()
  const from = left(place.column - 1) + WIDTH
  const to = left(place.column)
  const startY = top(place.parentRow) + HEIGHT / 2
  const endY = top(place.row) + HEIGHT / 2
  const bend = from + 14
  const middle = (bend + to) / 2
  const words = {
    good: '',
    errors: t('segment.cable.errors'),
    broken: t('segment.cable.broken'),
    beyond: '',
  }[place.cable]
  return (
    <g className={`cable ${place.cable}`}>
      <path d={`M${from} ${startY}H${bend}V${endY}H${to}`} />
      {place.cable === 'broken' && (
        <path d={`M${middle - 9} ${endY - 9}l18 18m0 -18l-18 18`} className="cross" />
      )}
      {words !== '' && (
        <text x={middle} y={endY - 15}>
          {words}
        </text>
      )}
    </g>
  )
}

function left(column: number): number {
  return MARGIN + column * (WIDTH + GAP)
}

function top(row: number): number {
  return MARGIN + row * ROW
}

function short(name: string): string {
  return name.length > 15 ? `${name.slice(0, 14)}…` : name
}
