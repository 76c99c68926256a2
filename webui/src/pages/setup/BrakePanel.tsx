import '../../widgets/layout/functions.css'
import { href } from '../../app/navigation/router'
import type { BrakeTiming, IoInfo } from '../../api/schema'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import { useReading } from '../../live/store'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterFields } from '../../widgets/parameters/ParameterFields'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useRows } from '../../widgets/profile-text/rows'
import { useFetched } from '../../widgets/drive/useFunctions'
import { brakeCourse } from './brake'

/** Settings of the holding brake next to the course that follows from them. */
export function BrakePanel({ drive, brake }: { drive: string; brake: BrakeTiming | null }) {
  const t = useT()
  if (!brake) {
    return (
      <Panel title={t('brake.title')}>
        <p>{t('brake.none')}</p>
      </Panel>
    )
  }
  return (
    <div className="columns">
      <Panel title={t('brake.title')}>
        <p className="note warn">{t('brake.warning')}</p>
        <Output drive={drive} functions={brake.output_functions ?? []} />
        {brake.notes && (
          <p className="prose">
            <ProfileText drive={drive} text={brake.notes} />
          </p>
        )}
        <ParameterFields drive={drive} keys={brake.keys ?? []} />
      </Panel>
      <Panel title={t('brake.picture')}>
        <Picture drive={drive} brake={brake} />
        {brake.fault && (
          <p>
            <ProfileText drive={drive} text={brake.fault} />
          </p>
        )}
        <p className="dim">{t('source', { source: brake.source })}</p>
      </Panel>
    </div>
  )
}

function useNumber(drive: string, key: string | null | undefined): number | null {
  const reading = useReading(drive, key ?? '')
  const row = (useRows(drive) ?? []).find((each) => each.key === key)
  const value = reading?.value ?? row?.reading.value ?? null
  return typeof value === 'number' ? value : null
}

/** Which output drives the brake, by the functions of the terminals. */
function Output({ drive, functions }: { drive: string; functions: number[] }) {
  const t = useT()
  const { data } = useFetched<IoInfo>(
    () => ask(api.GET('/api/v1/drives/{drive_id}/io', { params: { path: { drive_id: drive } } })),
    [drive],
  )
  if (functions.length === 0 || !data) return null
  const outputs = data.terminals.filter(
    (each) =>
      each.direction === 'out' && each.function !== null && functions.includes(each.function),
  )
  if (outputs.length === 0) {
    return (
      <p className="note warn">
        {t('brake.noOutput')} <a href={href('io', drive)}>{t('page.io')}</a>
      </p>
    )
  }
  return <p>{t('brake.outputIs', { name: outputs.map((each) => each.name).join(', ') })}</p>
}

const LEFT = 96
const WIDTH = 470
const TRACE = 34
const GAP = 20

function Picture({ drive, brake }: { drive: string; brake: BrakeTiming }) {
  const t = useT()
  const openDelay = useNumber(drive, brake.open_delay_key)
  const times = {
    openDelay: openDelay ?? brake.open_fixed_ms ?? null,
    commandDelay: useNumber(drive, brake.command_delay_key),
    closeDelay: useNumber(drive, brake.close_delay_key),
    closeSpeed: useNumber(drive, brake.close_speed_key),
    hold: useNumber(drive, brake.hold_key),
  }
  const course = brakeCourse(times)
  const x = (ms: number) => LEFT + (ms / course.end) * WIDTH
  const top = (i: number) => 18 + i * (TRACE + GAP)
  const height = top(course.traces.length)
  return (
    <svg
      className="brake-picture"
      viewBox={`0 0 ${LEFT + WIDTH + 10} ${height}`}
      role="img"
      aria-label={t('brake.picture')}
    >
      <title>{t('brake.picture')}</title>
      {course.traces.map((trace, i) => {
        const y = (value: number) => top(i) + TRACE * (1 - value)
        const path = trace.points.map(([ms, value], n) => `${n ? 'L' : 'M'}${x(ms)} ${y(value)}`)
        return (
          <g key={trace.name}>
            <text x={LEFT - 8} y={top(i) + TRACE - 6} className="label">
              {t(`brake.${trace.name}`)}
            </text>
            <path d={path.join('')} className="trace" />
            {trace.name === 'speed' && times.closeSpeed !== null && (
              <text x={x(course.end)} y={y(0.12) - 4} className="span end">
                {times.closeSpeed} rpm
              </text>
            )}
            {course.spans
              .filter((span) => span.trace === trace.name)
              .map((span) => (
                <g key={span.from}>
                  <path
                    d={`M${x(span.from)} ${top(i) - 5}V${top(i) + TRACE}M${x(span.to)} ${top(i) - 5}V${top(i) + TRACE}`}
                    className="mark-line"
                  />
                  <text x={x((span.from + span.to) / 2)} y={top(i) - 7} className="span">
                    {span.text}
                  </text>
                </g>
              ))}
          </g>
        )
      })}
    </svg>
  )
}
