import { NativeSelect, SegmentedControl } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import { resultOf } from '../../../api/results'
import type { MeasurementInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { dateTime } from '../../../widgets/numbers/format'
import { JobNote, useJobEnd } from '../../../widgets/jobs/JobNote'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { useAction } from '../../../widgets/requests/useAction'
import { filesOf } from '../../response/results'
import { useMeasurement } from '../../response/useMeasurements'
import { useToolJob } from '../../response/useToolJob'
import { StepNumbers } from './StepNumbers'
import type { Measured } from '../tools/form/ToolPanel'

/** A step of speed or a move, as a check of what the gains do. */
export function StepPanel({
  drive,
  limits,
  obstacle,
  cycleMs,
  stored,
}: Measured & {
  /** Earlier steps of this axis, newest first. */
  stored: MeasurementInfo[]
}) {
  const t = useT()
  const [kind, setKind] = useState<'speed' | 'move'>('speed')
  const [size, setSize] = useState<number | null>(100)
  const [speed, setSpeed] = useState<number | null>(300)
  const [acceleration, setAcceleration] = useState<number | null>(6000)
  const start = useAction()
  const { job, note, dismiss } = useToolJob(drive, 'step')
  const [shown, setShown] = useState('')
  const [over, setOver] = useState('')
  useJobEnd(job?.id ?? null, (ended) => {
    const file = filesOf(ended.result).at(-1)
    if (file === undefined || file === shown) return
    // What was shown until now, or else the newest of before, is what it is compared with.
    setOver(shown || (stored.find((each) => each.file !== file)?.file ?? ''))
    setShown(file)
  })
  const now = useMeasurement(shown || null)
  const before = useMeasurement(over || null)
  const result = resultOf('step', now.content?.result)
  const earlier = resultOf('step', before.content?.result)
  const names = stored.map((each) => ({
    value: each.file,
    label: `${each.drive} · ${dateTime(each.saved)}`,
  }))
  const go = () =>
    start.run(async () => {
      if (!limits || size === null || speed === null || acceleration === null) return
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/step', {
            params: { path: { drive_id: drive } },
            body: { ...limits, cycle_ms: cycleMs, kind, size, hold_s: 0.25, speed, acceleration },
          }),
        ),
      )
    })
  return (
    <Panel title={t('step.title')}>
      <SegmentedControl
        fullWidth
        value={kind}
        onChange={(next) => {
          setKind(next)
          setSize(next === 'speed' ? 100 : 1)
        }}
        data={(['speed', 'move'] as const).map((each) => ({
          value: each,
          label: t(`step.kind.${each}`),
        }))}
      />
      <div className="fields">
        <NumberField
          label={t('step.size')}
          unit={kind === 'speed' ? 'rpm' : 'rev'}
          value={size}
          onChange={setSize}
        />
        {kind === 'move' && (
          <>
            <NumberField
              label={t('motion.speed')}
              unit="rpm"
              value={speed}
              onChange={setSpeed}
              above={0}
            />
            <NumberField
              label={t('motion.acceleration')}
              unit="rpm/s"
              value={acceleration}
              onChange={setAcceleration}
              above={0}
            />
          </>
        )}
      </div>
      {limits && (
        <p className="note warn">
          {t('step.moves', { travel: limits.travel_limit, torque: limits.torque_limit })}
        </p>
      )}
      <StartButton
        obstacle={
          obstacle ??
          (!size || speed === null || acceleration === null ? t('start.incomplete') : null)
        }
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('step.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={note} onClose={dismiss} />
      {stored.length > 0 && (
        <div className="fields wide">
          <NativeSelect
            label={t('step.shown')}
            value={shown}
            onChange={(event) => setShown(event.currentTarget.value)}
            data={[{ value: '', label: '—' }, ...names]}
          />
          <NativeSelect
            label={t('step.compare')}
            value={over}
            onChange={(event) => setOver(event.currentTarget.value)}
            data={[{ value: '', label: '—' }, ...names.filter(({ value }) => value !== shown)]}
          />
        </div>
      )}
      <ProblemNote problem={now.problem ?? before.problem} />
      {result && earlier && earlier.kind !== result.kind && (
        <p className="note warn">{t('step.otherKind')}</p>
      )}
      {result && (
        <StepNumbers step={result} over={earlier?.kind === result.kind ? earlier : null} />
      )}
    </Panel>
  )
}
