import { useMemo } from 'react'
import { resultOf } from '../../../api/results'
import type { FirstPowerResult } from '../../../api/schema'
import { CurvesPlot } from '../../../plots/CurvesPlot'
import { useCurveColors } from './form/Answer'
import type { Text } from './form/shown'
import { amount } from '../steps/steps'
import { type Measured, ToolPanel, ToolStart, useToolRun } from './form/ToolPanel'

/** What a person states about one run; cleared after it. */
const STATED = ['nothing_hangs', 'load_supported'] as const

/** The checklist before the first closed loop. Its limits are its own: 10 % and 0.1 rev at most. */
export function FirstPowerPanel({ drive, obstacle, cycleMs }: Omit<Measured, 'limits'>) {
  const run = useToolRun('first-power', drive, { stated: STATED })
  const { text, values } = run
  const result = resultOf('first-power', run.job?.result)
  const stated = STATED.some((name) => values[name] === true) || values.powered !== true
  return (
    <ToolPanel run={run} answer={result && <FirstPowerAnswer result={result} text={text} />}>
      <p className="note warn">{text('danger')}</p>
      <p className="note warn">{text('warning')}</p>
      <ToolStart
        run={run}
        obstacle={obstacle}
        missing={stated ? null : text('state_first')}
        onStart={() => run.begin({ cycle_ms: cycleMs, ...values })}
      />
    </ToolPanel>
  )
}

const TONES = { passed: 'good', failed: 'warn', open: 'info' } as const

/** Verdict, one line for each check, and where the pulses turned the shaft. */
function FirstPowerAnswer({ result, text }: { result: FirstPowerResult; text: Text }) {
  const [first, second] = useCurveColors()
  const curves = useMemo(() => {
    const numbered = result.pulses.map((pulse, at) => ({ ...pulse, number: at + 1 }))
    return ([1, -1] as const).map((way) => {
      const ours = numbered.filter((each) => each.direction === way)
      return {
        label: text(way > 0 ? 'forward' : 'backward'),
        color: way > 0 ? first : second,
        x: ours.map((each) => each.number),
        y: ours.map((each) => each.to_rev),
      }
    })
  }, [result, text, first, second])
  const at = result.measured_at.slice(0, 19).replace('T', ' ')
  return (
    <>
      <p className={`note ${result.verdict === 'passed' ? 'good' : 'warn'}`}>
        {text(`verdict.${result.verdict}`)}
      </p>
      <ul className="plain" aria-label={text('check')}>
        {result.checks.map((each) => (
          <li key={each.name} className={`note ${TONES[each.status]}`}>
            {text(`${each.name}.${each.finding}`, { value: figure(each.value) })}
          </li>
        ))}
      </ul>
      {result.covers_pole_pairs != null && (
        <p className="dim">{text('covers', { value: String(result.covers_pole_pairs) })}</p>
      )}
      {result.guide && <p className="note info">{text(`guide.${result.guide}`)}</p>}
      {result.pulses.length > 0 && (
        <>
          <CurvesPlot
            curves={curves}
            xLabel={text('chart_number')}
            yLabel={text('chart_place')}
            label={text('chart')}
          />
          <p className="dim">
            {text('travel')}: {amount(result.travel_rev, 'rev')}; {text('torque')}:{' '}
            {amount(result.torque_percent, '%')}
          </p>
        </>
      )}
      <p className="dim">{text('measured_at', { at })}</p>
    </>
  )
}

/** Whole numbers in full, others to four digits; as the report has them. */
export function figure(value: number | null | undefined): string {
  if (value == null) return ''
  return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(4)))
}
