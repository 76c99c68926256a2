import { useFaultAtOpening } from '../../app/notes/AxisNotes'
import { useHasTour } from '../../app/tour/tour'
import { api, ask } from '../../api/client'
import type { AxisState, TransitionRequest } from '../../api/schema'
import { known, useT } from '../../i18n'
import { setState, useAxisState, useDrive, useLink } from '../../live/store'
import { FaultList } from '../../widgets/faults/FaultList'
import { FaultResetButton, FaultResetProblem, useFaultReset } from '../../widgets/faults/FaultReset'
import { quantity } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { Procedures } from '../../widgets/faults/Procedures'
import { Said } from '../../widgets/messages/Said'
import { useAction } from '../../widgets/requests/useAction'
import { useRecord } from '../../widgets/drive/useFunctions'
import { ScalesPanel } from './ScalesPanel'
import { SceneHere } from './SceneHere'
import { StateMachine } from './StateMachine'
import { travelOf } from './travel'
import { WatchPanel } from './WatchPanel'
import { WhatNext } from './WhatNext'

export function OverviewPage({ drive }: { drive: string }) {
  const t = useT()
  const state = useAxisState(drive)
  const summary = useDrive(drive)
  const change = useAction()
  // The demo shows its load without scrolling.
  const demo = useHasTour(useLink().open)
  const reported = useFaultAtOpening(state)
  const reset = useFaultReset(drive)
  const goTo = (goal: string) =>
    change.run(async () =>
      setState(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/transition', {
            params: { path: { drive_id: drive } },
            body: { goal: goal as TransitionRequest['goal'], mode: null },
          }),
        ),
      ),
    )
  return (
    <div className="page">
      <h1>
        {summary?.name} <small className="dim">{summary?.title}</small>
      </h1>
      {reported && state && (
        <Panel title={t('faults.active')} className="fault-panel">
          <FaultList drive={drive} faults={state.faults} />
          {state.faults.length === 0 && (
            <p className={state.fresh ? 'good-text' : 'dim'}>
              {t(state.fresh ? 'faults.none' : 'state.noAnswer')}
            </p>
          )}
          <FaultResetButton reset={reset} disabled={!state.fresh || state.faults.length === 0} />
          <FaultResetProblem reset={reset} />
        </Panel>
      )}
      <div className="overview-columns">
        <div className="stack">
          <Panel title={t('overview.now')}>
            <Quantities drive={drive} state={state} />
            <Words state={state} />
          </Panel>
          <div className="later stack">
            <WatchPanel drive={drive} />
            <ScalesPanel drive={drive} />
            <WhatNext drive={drive} />
            <Procedures drive={drive} />
          </div>
        </div>
        <div className="stack">
          {demo && <SceneHere drive={drive} />}
          <Panel title={t('overview.machine')}>
            <StateMachine
              state={state?.fresh ? state.state : null}
              goals={state?.fresh ? state.goals : []}
              busy={change.busy}
              onGoal={(goal) => void goTo(goal)}
            />
            <p className="dim">{t('overview.machineHelp')}</p>
            <Blocked state={state} />
            <ProblemNote problem={change.problem} onClose={change.clear} />
          </Panel>
          {!demo && (
            <div className="later">
              <SceneHere drive={drive} />
            </div>
          )}
        </div>
      </div>
    </div>
  )
}

const QUANTITIES = [
  'position',
  'velocity',
  'torque',
  'following_error',
  'dc_voltage',
  'temperature',
] as const

export function Quantities({ drive, state }: { drive: string; state: AxisState | null }) {
  const t = useT()
  const travel = travelOf(useRecord(drive), state)
  return (
    <dl className={`quantities ${state?.fresh ? '' : 'stale'}`}>
      {QUANTITIES.filter((name) => !state || state[name] !== null).map((name) => (
        <div key={name}>
          <dt>{t(`quantity.${name}`)}</dt>
          <dd>
            <span className="num">{quantity(state?.[name], state?.units[name] ?? '')}</span>{' '}
            <span className="unit">{state?.units[name]}</span>
          </dd>
        </div>
      ))}
      {travel.map(({ name, value, unit }) => (
        <div key={name}>
          <dt>{t(`travel.${name}`)}</dt>
          <dd>
            <span className="num">{value}</span> <span className="unit">{unit}</span>
          </dd>
        </div>
      ))}
    </dl>
  )
}

function Words({ state }: { state: AxisState | null }) {
  const t = useT()
  if (!state) return null
  const flags: [string, boolean][] = [
    [t('flag.target_reached'), state.target_reached],
    [t('flag.internal_limit'), state.internal_limit],
    ...Object.entries(state.mode_bits).map(([name, on]): [string, boolean] => [
      known(t, 'bit', name),
      on,
    ]),
  ]
  return (
    <>
      <p>
        {t('overview.mode')} <strong>{known(t, 'mode', state.mode_name)}</strong>
        {state.status_word !== null && (
          <span className="dim mono">
            {' '}
            {t('overview.statusWord')} 0x
            {state.status_word.toString(16).toUpperCase().padStart(4, '0')}
          </span>
        )}
      </p>
      <ul className="flags">
        {flags.map(([name, on]) => (
          <li key={name} className={on ? 'on' : ''}>
            <span aria-hidden="true">{on ? '●' : '○'}</span> {name}: {t(on ? 'yes' : 'no')}
          </li>
        ))}
      </ul>
    </>
  )
}

export function Blocked({ state }: { state: AxisState | null }) {
  const t = useT()
  if (!state?.fresh || state.blocked_by.length === 0) return null
  return (
    <div className="note warn">
      <strong>{t('overview.blocked')}</strong>
      <ul>
        {state.blocked_by.map((cause, n) => (
          <li key={cause}>
            <Said message={state.blocked_by_messages?.[n]} words={cause} />
          </li>
        ))}
      </ul>
    </div>
  )
}
