import { useComputedColorScheme } from '@mantine/core'
import { useMemo } from 'react'
import { type Key, useT } from '../../../i18n'
import { fixed } from '../../response/plot/bode'
import { Legend } from '../../response/plot/Legend'
import type { Step } from '../../response/results'
import { StepPlot, type Trace } from '../../response/plot/StepPlot'
import { TRACE_COLORS } from '../../scope/setup/channels'
import { engineering } from './steps'

/** A step's curves and its numbers; `over` is an earlier one, drawn on the same axes. */
export function StepNumbers({ step, over = null }: { step: Step; over?: Step | null }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const colors = TRACE_COLORS[dark ? 'dark' : 'light']
  const names = [t('step.demand'), t('step.actual'), t('step.before')]
  const motion = useMemo(
    () => traces(step, over, names, colors, (each) => each.actual),
    [step, over, dark, names.join()],
  )
  const torque = useMemo(
    () => traces(step, over, names, colors, (each) => each.torque_percent).slice(1),
    [step, over, dark, names.join()],
  )
  return (
    <>
      <h3>{t('predict.step')}</h3>
      <Legend of={motion} />
      <StepPlot
        traces={motion}
        unit={step.unit}
        label={t('predict.step')}
        timeLabel={t('predict.time')}
        dark={dark}
      />
      <StepPlot
        traces={torque}
        unit={t('step.torqueUnit')}
        label={t('step.torque')}
        timeLabel={t('predict.time')}
        dark={dark}
        height={150}
      />
      {step.lost_percent > 0 && (
        <p className="note warn">
          {t('step.samplesLost', { percent: engineering(step.lost_percent) })}
        </p>
      )}
      <div className="scroll-table">
        <table aria-label={t('step.numbers')}>
          <thead>
            <tr>
              <th>{t('inertia.quantity')}</th>
              {over && <th className="right">{t('step.before')}</th>}
              <th className="right">{t('step.now')}</th>
            </tr>
          </thead>
          <tbody className="num">
            {ROWS.filter(({ read }) => (read(step) ?? (over && read(over))) !== null).map(
              ({ text, read }) => (
                <tr key={text}>
                  <td>{t(text)}</td>
                  {over && <td className="right">{read(over) ?? '—'}</td>}
                  <td className="right">{read(step) ?? '—'}</td>
                </tr>
              ),
            )}
          </tbody>
        </table>
      </div>
    </>
  )
}

const ms = (s: number | null) => fixed(s === null ? null : s * 1000, 1, 'ms')

interface Row {
  text: Key
  /** Null where this kind of step has no such number. */
  read: (step: Step) => string | null
}

const ROWS: Row[] = [
  {
    text: 'candidate.overshoot',
    read: ({ step }) => step && fixed(step.overshoot_percent, 1, '%'),
  },
  { text: 'step.rise', read: ({ step }) => step && ms(step.rise_s) },
  {
    text: 'step.following',
    read: ({ move, unit }) => move && fixed(move.following_peak, 4, unit),
  },
  {
    text: 'step.followingRms',
    read: ({ move, unit }) => move && fixed(move.following_rms, 5, unit),
  },
  {
    text: 'candidate.settling',
    read: ({ step, move }) => ms((step ?? move)?.settling_s ?? null),
  },
  {
    text: 'step.windowWidened',
    read: ({ widened, window, unit }) => (widened && window ? fixed(window, 2, unit) : null),
  },
  { text: 'step.torquePeak', read: (each) => fixed(each.torque_peak_percent, 0, '%') },
  { text: 'step.torqueRms', read: (each) => fixed(each.torque_rms_percent, 0, '%') },
]

function traces(
  step: Step,
  over: Step | null,
  [demand = '', actual = '', before = '']: string[],
  colors: string[],
  of: (step: Step) => number[],
): Trace[] {
  const found: Trace[] = [
    {
      label: demand,
      color: colors[1] ?? '',
      dashed: true,
      time: step.time_s,
      value: step.demand,
    },
  ]
  if (over) {
    found.push({
      label: before,
      color: colors[3] ?? '',
      dashed: true,
      time: over.time_s,
      value: of(over),
    })
  }
  return [...found, { label: actual, color: colors[0] ?? '', time: step.time_s, value: of(step) }]
}
