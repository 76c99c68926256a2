import { Checkbox, NativeSelect, useComputedColorScheme } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { SweepRequest } from '../../../api/schema'
import { useT } from '../../../i18n'
import { setJob } from '../../../live/store'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../widgets/jobs/StartButton'
import { useAction } from '../../../widgets/requests/useAction'
import { useObstacle } from '../../../widgets/jobs/useObstacle'
import { useWrong } from '../../../widgets/numbers/useWrong'
import { useRemembered } from '../../../widgets/browser/remembered'
import { ExcitationPreview } from './ExcitationPreview'
import { LimitFields, useLimits } from '../plot/limits'
import type { Measurable } from './measurable'

const KINDS = ['mechanics', 'speed_loop', 'position_loop'] as const
const LOOPS = ['auto', 'none', 'speed', 'position'] as const
const SIGNALS = ['multisine', 'chirp', 'prbs', 'stepped'] as const

/** What to measure, within which limits, and what will move. */
export function SweepForm({ drive, way }: { drive: string; way: Measurable }) {
  const t = useT()
  const [kind, setKind] = useState<SweepRequest['kind']>('mechanics')
  const [loop, setLoop] = useState<SweepRequest['loop']>('auto')
  const [signal, setSignal] = useState<SweepRequest['excitation']>('multisine')
  const [low, setLow] = useRemembered(drive, 'sweep.low', 5)
  const [high, setHigh] = useState<number | null>(null)
  const [share, setShare] = useRemembered(drive, 'sweep.share', 35)
  const [count, setCount] = useRemembered(drive, 'sweep.count', 2)
  const [base, setBase] = useState(true)
  const [odd, setOdd] = useState(false)
  const stepped = signal === 'stepped'
  const canOdd = signal === 'multisine' && kind === 'mechanics'
  const limits = useLimits(drive)
  const start = useAction()
  const obstacle = useObstacle(drive)
  const dark = useComputedColorScheme('light') === 'dark'
  const [previewed, setPreviewed] = useState(false)
  const highest = high ?? Number.POSITIVE_INFINITY
  const wrong = useWrong()
  const request: SweepRequest | null =
    limits.limits === null ||
    low === null ||
    share === null ||
    count === null ||
    wrong.any ||
    highest < 4 * low
      ? null
      : {
          ...limits.limits,
          kind,
          excitation: signal,
          loop: kind === 'mechanics' ? loop : 'auto',
          f_min_hz: low,
          f_max_hz: high,
          share: share / 100,
          realisations: count,
          base_motion: base,
          odd_lines: odd && canOdd,
          cycle_ms: way.cycleMs,
        }
  const go = () =>
    start.run(async () => {
      if (!request) return
      setJob(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/jobs/sweep', {
            params: { path: { drive_id: drive } },
            body: request,
          }),
        ),
      )
    })
  return (
    <Panel title={t('sweep.title')}>
      <NativeSelect
        label={t('sweep.what')}
        value={kind}
        onChange={(event) => setKind(event.currentTarget.value as SweepRequest['kind'])}
        data={KINDS.filter((each) => each !== 'position_loop' || !way.bySpeed).map((each) => ({
          value: each,
          label: t(`sweep.kind.${each}`),
        }))}
      />
      <p className="dim">{t(`sweep.help.${kind}`)}</p>
      {way.bySpeed && (
        <p className="note info">
          {t('unwatched.bySpeed', {
            ms: way.cycleMs,
            direct: 250 / way.cycleMs,
            model: 400 / way.cycleMs,
          })}
        </p>
      )}
      <LimitFields of={limits} />
      <details>
        <summary>{t('sweep.more')}</summary>
        <NativeSelect
          label={t('sweep.excitation')}
          value={signal}
          onChange={(event) => {
            const chosen = event.currentTarget.value as typeof signal
            setSignal(chosen)
            // One tone after another lasts too long for an axis that no loop holds.
            if (chosen === 'stepped' && loop === 'none') setLoop('auto')
          }}
          data={SIGNALS.map((each) => ({ value: each, label: t(`sweep.excitation.${each}`) }))}
        />
        <p className="dim">{t(`sweep.excitation.help.${signal}`)}</p>
        <div className="fields">
          {kind === 'mechanics' && !way.bySpeed && (
            <NativeSelect
              label={t('sweep.loop')}
              value={loop}
              onChange={(event) => setLoop(event.currentTarget.value as SweepRequest['loop'])}
              data={LOOPS.filter((each) => each !== 'none' || !stepped).map((each) => ({
                value: each,
                label: t(`sweep.loop.${each}`),
              }))}
            />
          )}
          <NumberField
            label={t('signal.from')}
            unit="Hz"
            value={low}
            onChange={setLow}
            min={3}
            max={500}
          />
          <NumberField
            label={t('signal.to')}
            unit="Hz"
            value={high}
            onChange={setHigh}
            onWrong={wrong.of('high')}
            optional
            min={4 * (low ?? 3)}
            help={t('sweep.highHelp')}
          />
          {kind === 'mechanics' && (
            <NumberField
              label={t('sweep.share')}
              unit="%"
              value={share}
              onChange={setShare}
              min={1}
              max={90}
              help={t('sweep.shareHelp')}
            />
          )}
          {!stepped && (
            <NumberField
              label={t('sweep.count')}
              value={count}
              onChange={setCount}
              min={1}
              max={8}
              integer
              help={t('sweep.countHelp')}
            />
          )}
        </div>
        <Checkbox
          label={t('sweep.base')}
          checked={base}
          onChange={(event) => setBase(event.currentTarget.checked)}
        />
        {canOdd && (
          <Checkbox
            label={t('sweep.odd')}
            checked={odd}
            onChange={(event) => setOdd(event.currentTarget.checked)}
          />
        )}
      </details>
      <details onToggle={(event) => setPreviewed(event.currentTarget.open)}>
        <summary>{t('excite.title')}</summary>
        {previewed && <ExcitationPreview drive={drive} request={request} dark={dark} />}
      </details>
      {limits.limits && (
        <p className="note warn">
          {t(kind === 'mechanics' ? 'sweep.moves' : 'sweep.movesLoop', {
            torque: limits.limits.torque_limit,
            part: Math.round((limits.limits.torque_limit * (share ?? 0)) / 100),
            travel: limits.limits.travel_limit,
            speed: limits.limits.speed_limit,
          })}
        </p>
      )}
      <StartButton
        obstacle={
          obstacle ?? (!request ? t('start.incomplete') : !limits.agreed ? t('start.agree') : null)
        }
        busy={start.busy}
        onStart={() => void go()}
      >
        {t('sweep.start')}
      </StartButton>
      <ProblemNote problem={start.problem} onClose={start.clear} />
    </Panel>
  )
}
