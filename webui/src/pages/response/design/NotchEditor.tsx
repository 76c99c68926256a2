import { Button, Checkbox, Modal } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { NotchSlotInfo } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { fixed, hertz } from '../plot/bode'
import type { NotchShape } from '../results'
import { remember } from './undo'
import { UndoNote } from './UndoNote'
import { inForce, legible, type Notches, same } from './useNotches'

const NEW: NotchShape = { center_hz: 400, width_hz: 150, depth_db: -20 }

/** Notches slot by slot: what is wanted, and what the drive will really do after rounding. */
export function NotchEditor({ drive, notches }: { drive: string; notches: Notches }) {
  const t = useT()
  const say = useSay()
  const [confirming, setConfirming] = useState(false)
  const [bad, setBad] = useState<ReadonlyMap<string, number>>(new Map())
  const write = useAction()
  const { now, wanted, preview, refused, edited } = notches
  if (!now) {
    // A family without notches is no fault of anything.
    return notches.problem ? (
      <Panel title={t('notch.title')}>
        <p className="dim">{say.detail(notches.problem)}</p>
        {notches.problem.remedy && (
          <p className="dim">
            {t('problem.try')} {say.remedy(notches.problem)}
          </p>
        )}
      </Panel>
    ) : null
  }
  const put = (slot: number, notch: NotchShape, name: keyof NotchShape, value: number | null) => {
    const next = new Map(bad)
    // The field shows what is no number, where the notch still has its last one.
    if (value === null) next.set(`${slot} ${name}`, notch[name])
    else next.delete(`${slot} ${name}`)
    setBad(next)
    if (value !== null) notches.set(slot, { ...notch, [name]: value })
  }
  const unsound = wanted.some(
    (notch, i) =>
      notch !== null &&
      (['center_hz', 'width_hz', 'depth_db'] as const).some(
        (name) => bad.get(`${i} ${name}`) === notch[name],
      ),
  )
  const go = () =>
    write.run(async () => {
      const done = await ask(
        api.PUT('/api/v1/drives/{drive_id}/notches', {
          params: { path: { drive_id: drive } },
          body: { notches: wanted },
        }),
      )
      remember(drive, 'notches', done)
      await notches.read()
    })
  return (
    <Panel title={t('notch.title')}>
      <p className="dim">{t(notches.shaped ? 'notch.help' : 'notch.levels')}</p>
      <ol className="notches">
        {now.map((slot, i) => {
          const notch = wanted[i] ?? null
          const made = preview?.slots[i]
          return (
            <li key={slot.slot} className={same(inForce(slot), notch) ? '' : 'edited'}>
              <Checkbox
                label={t('notch.slot', { number: slot.slot + 1 })}
                checked={notch !== null}
                disabled={!notches.shaped}
                onChange={(event) => {
                  setBad(new Map([...bad].filter(([key]) => !key.startsWith(`${i} `))))
                  notches.set(
                    i,
                    event.currentTarget.checked ? (slot.notch ? legible(slot.notch) : NEW) : null,
                  )
                }}
              />
              {notch && notches.shaped && (
                <div className="fields">
                  <NumberField
                    label={t('notch.center')}
                    unit="Hz"
                    value={notch.center_hz}
                    above={0}
                    onChange={(center) => put(i, notch, 'center_hz', center)}
                  />
                  <NumberField
                    label={t('notch.width')}
                    unit="Hz"
                    value={notch.width_hz}
                    above={0}
                    onChange={(width) => put(i, notch, 'width_hz', width)}
                  />
                  <NumberField
                    label={t('notch.depth')}
                    unit="dB"
                    value={notch.depth_db}
                    max={0}
                    onChange={(depth) => put(i, notch, 'depth_db', depth)}
                  />
                </div>
              )}
              {notch && made?.realised && (
                <p className={made.realised.stable ? 'dim num' : 'fault-text num'}>
                  {t('notch.really', {
                    center: hertz(made.realised.center_hz),
                    width: hertz(made.realised.width_hz),
                    depth: fixed(made.realised.depth_db, 1, 'dB'),
                  })}
                  {(made.realised.dc_gain_db ?? 0) !== 0 &&
                    Math.abs(made.realised.dc_gain_db ?? 0) > 0.05 &&
                    ` ${t('notch.dc', { gain: fixed(made.realised.dc_gain_db, 2, 'dB') })}`}
                  {!made.realised.stable && ` ${t('notch.unstable')}`}
                </p>
              )}
              <SlotNote of={made?.note ? made : slot} />
            </li>
          )
        })}
      </ol>
      <ProblemNote problem={refused} />
      <div className="row wrap">
        <Button
          variant="filled"
          disabled={!edited || unsound || refused !== null || preview === null}
          loading={write.busy}
          onClick={() => setConfirming(true)}
        >
          {t('notch.write')}
        </Button>
        <Button disabled={write.busy} onClick={() => void notches.read()}>
          {t('notch.read')}
        </Button>
        {edited && <span className="tag-edited">{t('notch.edited')}</span>}
      </div>
      <ProblemNote problem={write.problem} onClose={write.clear} />
      <UndoNote drive={drive} onUndone={() => void notches.read()} />
      {confirming && (
        <Modal opened onClose={() => setConfirming(false)} title={t('notch.write')}>
          <p>{t('notch.confirm')}</p>
          <ul>
            {wanted.map((each, i) => (
              <li key={i} className="num">
                {t('notch.slot', { number: i + 1 })}:{' '}
                {each
                  ? `${hertz(each.center_hz)} · ${hertz(each.width_hz)} · ${fixed(each.depth_db, 1, 'dB')}`
                  : t('notch.off')}
              </li>
            ))}
          </ul>
          <div className="row end">
            <Button onClick={() => setConfirming(false)}>{t('cancel')}</Button>
            <Button
              variant="filled"
              onClick={() => {
                setConfirming(false)
                void go()
              }}
            >
              {t('notch.writeNow')}
            </Button>
          </div>
        </Modal>
      )}
    </Panel>
  )
}

/** What is known of one notch next to its values. */
function SlotNote({ of }: { of: NotchSlotInfo }) {
  const say = useSay()
  const note = say.message(of.note_message, of.note)
  return note ? <p className="dim">{note}</p> : null
}
