import { Button, Modal, SegmentedControl } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { GearPlanInfo, GearWritten, Mechanics } from '../../api/schema'
import { known, useT } from '../../i18n'
import { figure } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProcedureButton } from '../../widgets/faults/Procedures'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useSay } from '../../widgets/profile-text/texts'
import { Said } from '../../widgets/messages/Said'
import { useAction } from '../../widgets/requests/useAction'
import { setRecord } from '../../widgets/drive/useFunctions'
import { type Form, KINDS } from './mechanics'
import { MechanicsFields } from './MechanicsFields'
import { useMechanics } from './useMechanics'

/** From screw, belt, rack or table to the gear of the drive, shown before it is written. */
export function GearPanel({ drive }: { drive: string }) {
  const t = useT()
  const { kept, form, change: retype, mechanics, keep, act } = useMechanics(drive)
  const [made, setMade] = useState<{ plan: GearPlanInfo; of: Mechanics } | null>(null)
  const [asked, setAsked] = useState(false)
  const [written, setWritten] = useState<GearWritten | null>(null)
  // The form may have become another one since: by typing, or by what somebody else has kept.
  const current = made !== null && JSON.stringify(made.of) === JSON.stringify(mechanics)
  const plan = current || written ? (made?.plan ?? null) : null
  const change = (part: Partial<Form>) => {
    retype(part)
    setMade(null)
    setWritten(null)
  }
  const calculate = () =>
    act.run(async () => {
      if (!mechanics) return
      const found = await ask(
        api.POST('/api/v1/drives/{drive_id}/gear/plan', {
          params: { path: { drive_id: drive } },
          body: mechanics,
        }),
      )
      setMade({ plan: found, of: mechanics })
    })
  const write = () =>
    act.run(async () => {
      if (!made || !current) return
      const done = await ask(
        api.POST('/api/v1/drives/{drive_id}/gear/write', {
          params: { path: { drive_id: drive } },
          body: made.of,
        }),
      )
      setWritten(done)
      setRecord(
        drive,
        await ask(
          api.GET('/api/v1/drives/{drive_id}/record', { params: { path: { drive_id: drive } } }),
        ),
      )
    })
  return (
    <div className="columns">
      <Panel title={t('setup.gear')}>
        <p className="prose">{t('setup.gearHelp')}</p>
        <SegmentedControl
          fullWidth
          value={form.kind}
          onChange={(kind) => change({ kind: kind })}
          data={KINDS.map((value) => ({ value, label: t(`gear.kind.${value}`) }))}
        />
        <MechanicsFields form={form} change={change} />
        <div className="row wrap">
          <Button
            variant="filled"
            disabled={!mechanics}
            loading={act.busy}
            onClick={() => void calculate()}
          >
            {t('gear.plan')}
          </Button>
          <Button disabled={!mechanics || act.busy} onClick={() => void keep(mechanics)}>
            {t('gear.keep')}
          </Button>
          {kept && (
            <Button disabled={act.busy} onClick={() => void keep(null)}>
              {t('gear.forget')}
            </Button>
          )}
        </div>
        <ProblemNote problem={act.problem} onClose={act.clear} />
      </Panel>
      {plan && (
        <PlanPanel drive={drive} plan={plan} busy={act.busy} onWrite={() => setAsked(current)}>
          {written && (
            <Written
              drive={drive}
              written={written}
              onUndone={() => {
                setWritten(null)
                void calculate()
              }}
            />
          )}
        </PlanPanel>
      )}
      {asked && current && (
        <Modal opened onClose={() => setAsked(false)} title={t('gear.write')}>
          <p className="note warn">{t('gear.confirm')}</p>
          {made.plan.counted.length > 0 && (
            <p>{t('gear.counted', { keys: made.plan.counted.join(', ') })}</p>
          )}
          <div className="row end">
            <Button onClick={() => setAsked(false)}>{t('cancel')}</Button>
            <Button
              variant="filled"
              onClick={() => {
                setAsked(false)
                void write()
              }}
            >
              {t('gear.write')}
            </Button>
          </div>
        </Modal>
      )}
    </div>
  )
}

function Written({
  drive,
  written,
  onUndone,
}: {
  drive: string
  written: GearWritten
  onUndone: () => void
}) {
  const t = useT()
  const undo = useAction()
  const waits = [...new Set(Object.values(written.waits))]
  const back = () =>
    undo.run(async () => {
      for (const [key, raw] of Object.entries(written.before).toReversed()) {
        await ask(
          api.PUT('/api/v1/drives/{drive_id}/parameters/{key}', {
            params: { path: { drive_id: drive, key } },
            body: { raw, value: null },
          }),
        )
      }
      onUndone()
    })
  return (
    <div className="note good" role="status">
      <p>
        {t('gear.written')}{' '}
        {waits.length > 0 &&
          t('gear.waits', { what: waits.map((why) => known(t, 'effective', why)).join(', ') })}
      </p>
      <div className="row wrap">
        {waits.includes('write_settings') && (
          <ProcedureButton drive={drive} name="write_settings" label={t('gear.applyNow')} />
        )}
        {Object.keys(written.before).length > 0 && (
          <Button loading={undo.busy} onClick={() => void back()}>
            {t('gear.undo')}
          </Button>
        )}
      </div>
      <ProblemNote problem={undo.problem} onClose={undo.clear} />
    </div>
  )
}

function PlanPanel({
  drive,
  plan,
  busy,
  onWrite,
  children,
}: {
  drive: string
  plan: GearPlanInfo
  busy: boolean
  onWrite: () => void
  children: React.ReactNode
}) {
  const t = useT()
  const say = useSay(drive)
  const same = plan.values.every((value) => value.now === value.raw)
  const facts: [string, string][] = [
    [t('gear.perTurn'), `${figure(plan.travel_per_motor_turn, 7)} ${plan.unit}`],
    [t('gear.increments'), figure(plan.reached, 9)],
    [t('gear.error'), `${figure(plan.error_ppm, 2)} ppm`],
    [t('gear.encoder'), `${figure(plan.encoder_travel, 4)} ${plan.unit}`],
    ...(plan.max_speed !== null && plan.max_speed_rpm !== null
      ? [
          [
            t('gear.speed', { rpm: plan.max_speed_rpm }),
            `${figure(plan.max_speed, 5)} ${plan.unit}/s`,
          ] as [string, string],
        ]
      : []),
    [t('gear.range'), `± ${figure(plan.range_travel, 6)} ${plan.unit}`],
  ]
  return (
    <Panel title={t('gear.result')}>
      <dl className="facts">
        {facts.map(([name, text]) => (
          <div key={name} className="pair">
            <dt>{name}</dt>
            <dd className="num">{text}</dd>
          </div>
        ))}
      </dl>
      <table>
        <thead>
          <tr>
            <th>{t('column.name')}</th>
            <th className="right">{t('gear.now')}</th>
            <th className="right">{t('gear.new')}</th>
          </tr>
        </thead>
        <tbody className="num">
          {plan.values.map((value) => (
            <tr key={value.key} className={value.now === value.raw ? '' : 'changed'}>
              <td>
                {value.name} <small className="dim mono">{value.key}</small>
              </td>
              <td className="right">{value.now ?? '—'}</td>
              <td className="right">
                <strong>{value.raw}</strong>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      {plan.warnings.map((text, n) => (
        <p key={text} className="note warn">
          <Said message={plan.warnings_messages?.[n]} words={text} />
        </p>
      ))}
      {plan.acts && <p>{t('gear.acts', { acts: say(plan.acts) })}</p>}
      {plan.notes && (
        <p className="dim">
          <ProfileText drive={drive} text={plan.notes} />
        </p>
      )}
      {plan.source && <p className="dim">{t('source', { source: plan.source })}</p>}
      <Button variant="filled" disabled={same} loading={busy} onClick={onWrite}>
        {t('gear.write')}
      </Button>
      {children}
    </Panel>
  )
}
