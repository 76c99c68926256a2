import { Button, SegmentedControl } from '@mantine/core'
import { Fragment, useState } from 'react'
import { api, ask } from '../../api/client'
import { known, useT } from '../../i18n'
import { setState, useAxisState, useDrive, useJob } from '../../live/store'
import { JobNote } from '../../widgets/jobs/JobNote'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { StateName } from '../../widgets/drive/StateName'
import { useAction } from '../../widgets/requests/useAction'
import { Blocked, Quantities } from '../overview/OverviewPage'
import { HomingPanel } from './homing/HomingPanel'
import { JogPanel } from './jog/JogPanel'
import { MovePanel } from './moves/MovePanel'
import { SequencePanel } from './moves/SequencePanel'
import { SettingsPanel } from './SettingsPanel'
import { SignalPanel, useCyclic } from './moves/SignalPanel'
import { useTravelUnit } from './fields/useTravelUnit'

const TABS = ['jog', 'move', 'sequence', 'homing', 'signal', 'settings'] as const

export function MotionPage({ drive }: { drive: string }) {
  const t = useT()
  const summary = useDrive(drive)
  const state = useAxisState(drive)
  const [tab, setTab] = useState<(typeof TABS)[number]>('jog')
  const [jobs, setJobs] = useState<Record<string, string>>({})
  const moving = useJob(state?.moving_job ?? null)
  const mine = jobs[drive] ?? null
  const cyclic = useCyclic(summary, state)
  const { unit, possible, choose } = useTravelUnit(drive, state)
  if (!summary) return null
  const started = (id: string) => setJobs((old) => ({ ...old, [drive]: id }))
  return (
    <div className="page">
      <h1>
        {t('page.motion')} <small className="dim">{summary.name}</small>
      </h1>
      <div className="columns motion-columns">
        <div>
          <SegmentedControl
            className="motion-tabs"
            fullWidth
            value={tab}
            onChange={(next) => setTab(next)}
            data={TABS.filter((name) => name !== 'signal' || cyclic).map((name) => ({
              value: name,
              label: t(`motion.tab.${name}`),
            }))}
          />
          {possible.length > 1 && tab !== 'settings' && (
            <div className="travel-unit">
              <span id="travel-unit">{t('motion.unit')}</span>
              <SegmentedControl
                aria-labelledby="travel-unit"
                value={unit.name}
                disabled={state?.moving_job != null}
                onChange={choose}
                data={possible.map((name) => ({ value: name, label: name }))}
              />
            </div>
          )}
          {/* A number typed in one unit is never left standing in another. */}
          <Fragment key={unit.name}>
            {tab === 'jog' && <JogPanel drive={drive} state={state} unit={unit} />}
            {tab === 'move' && (
              <MovePanel drive={summary} {...{ state, unit }} onStarted={started} />
            )}
            {tab === 'sequence' && (
              <SequencePanel drive={drive} {...{ state, unit }} onStarted={started} />
            )}
            {tab === 'signal' && (
              <SignalPanel drive={summary} {...{ state, unit }} onStarted={started} />
            )}
            {tab === 'homing' && <HomingPanel drive={drive} unit={unit} onStarted={started} />}
          </Fragment>
          {tab === 'settings' && <SettingsPanel drive={drive} />}
          {moving && moving.id !== mine && moving.kind !== 'jog' && <JobNote id={moving.id} />}
          <JobNote id={mine} onClose={() => started('')} />
        </div>
        <Panel title={t('overview.now')}>
          <Quantities drive={drive} state={state} />
          <p>
            {t('motion.state')} <strong>{state ? <StateName state={state.state} /> : '—'}</strong> ·{' '}
            {state && known(t, 'mode', state.mode_name)}
          </p>
          <Power drive={drive} />
          <Blocked state={state} />
        </Panel>
      </div>
    </div>
  )
}

function Power({ drive }: { drive: string }) {
  const t = useT()
  const state = useAxisState(drive)
  const act = useAction()
  const goals = state?.fresh ? state.goals : []
  const goTo = (goal: 'Operation enabled' | 'Switch on disabled') =>
    act.run(async () =>
      setState(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/transition', {
            params: { path: { drive_id: drive } },
            body: { goal, mode: null },
          }),
        ),
      ),
    )
  return (
    <>
      <div className="row">
        <Button
          disabled={
            !goals.includes('Operation enabled') || state?.state === 'Operation enabled' || act.busy
          }
          onClick={() => void goTo('Operation enabled')}
        >
          {t('motion.enable')}
        </Button>
        <Button
          // Taking the power off is also tried where the drive missed an answer.
          disabled={
            act.busy ||
            (state?.fresh === true &&
              (!goals.includes('Switch on disabled') || state.state === 'Switch on disabled'))
          }
          onClick={() => void goTo('Switch on disabled')}
        >
          {t('motion.disable')}
        </Button>
      </div>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}
