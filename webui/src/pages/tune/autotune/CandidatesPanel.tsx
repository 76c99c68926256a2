import { Button, Modal, NativeSelect } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask, problemOf } from '../../../api/client'
import type { CandidatesRequest, GainInfo, MeasurementInfo } from '../../../api/schema'
import { known, useT } from '../../../i18n'
import { href } from '../../../app/navigation/router'
import { dateTime } from '../../../widgets/numbers/format'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { fixed, hertz } from '../../response/plot/bode'
import type { Candidate } from '../../response/results'
import { remember } from '../../response/design/undo'
import { UndoNote } from '../../response/design/UndoNote'
import { CandidateTable } from './CandidateTable'
import { amount } from '../steps/steps'

/** What the server answers when a manual documents no notch. */
const NONE_DOCUMENTED = 'urn:servodeck:not-allowed'
const LOADS = ['auto', 'stiff', 'medium', 'compliant'] as const

/** Designs, and what they were computed of: their gains hold for no other inertia. */
interface Designs {
  load: string
  rows: Candidate[]
  file: string
  inertia: number
  wanted: (typeof LOADS)[number]
}

/** Gains and notches computed from a stored response; one of them can be written. */
export function CandidatesPanel({
  drive,
  name,
  list,
  gains,
  inertia,
  onApplied,
}: {
  drive: string
  /** Name of the axis, as its measurements have it. */
  name: string
  /** Responses of this axis, and of others of its family. */
  list: MeasurementInfo[]
  gains: GainInfo
  inertia: number | null
  onApplied: () => Promise<void>
}) {
  const t = useT()
  const [chosen, setChosen] = useState('')
  const [load, setLoad] = useState<(typeof LOADS)[number]>('auto')
  const [total, setTotal] = useState<number | null>(null)
  const [found, setFound] = useState<Designs | null>(null)
  const [asked, setAsked] = useState<{ candidate: Candidate; inertia: number } | null>(null)
  /** The gains were written, the notches that belong to them were not. */
  const [half, setHalf] = useState(false)
  const [written, setWritten] = useState(false)
  const design = useAction()
  const write = useAction()
  const total_ = inertia ?? gains.inertia_kgm2
  useEffect(() => {
    if (total_ !== null) setTotal(Number(total_.toPrecision(4)))
  }, [total_])
  // Another machine is measured only where a person chooses that.
  const file = chosen || (list.find((each) => each.drive === name)?.file ?? '')
  const designs =
    found?.file === file && found.inertia === total && found.wanted === load ? found : null
  const go = () =>
    design.run(async () => {
      if (total === null) return
      const body: CandidatesRequest = {
        measurement: file,
        inertia_kgm2: total,
        load: load === 'auto' ? null : load,
      }
      const answer = await ask(
        api.POST('/api/v1/drives/{drive_id}/tune/candidates', {
          params: { path: { drive_id: drive } },
          body,
        }),
      )
      const { load: judged, candidates: rows } = answer
      setFound({ load: judged, rows, file, inertia: total, wanted: load })
      setWritten(false)
    })
  const apply = (candidate: Candidate, inertia_kgm2: number) =>
    write.run(async () => {
      setWritten(false)
      setHalf(false)
      // Asked first: a family without notches has nothing to write, any other failure ends it here.
      const hasNotches = await documentsNotches(drive)
      const path = { params: { path: { drive_id: drive } } }
      const { speed_bandwidth_hz, integral_hz, position_1_s } = candidate.gains
      const gains = await ask(
        api.PUT('/api/v1/drives/{drive_id}/gains', {
          ...path,
          body: { gains: { speed_bandwidth_hz, integral_hz, position_1_s, inertia_kgm2 } },
        }),
      )
      // Kept at once: the way back must be there even when the notches are refused.
      remember(drive, 'gains', gains)
      if (hasNotches) {
        try {
          const notches = await ask(
            api.PUT('/api/v1/drives/{drive_id}/notches', {
              ...path,
              body: { notches: candidate.notches },
            }),
          )
          remember(drive, 'notches', notches)
        } catch (error) {
          setHalf(true)
          throw error
        }
      }
      setWritten(true)
      await onApplied()
    })
  return (
    <Panel title={t('candidate.title')}>
      <p className="dim">{t('candidate.help')}</p>
      {list.length === 0 ? (
        <p className="note info">
          {t('candidate.measure')} <a href={href('response', drive)}>{t('page.response')}</a>
        </p>
      ) : (
        <>
          <div className="fields wide">
            <NativeSelect
              label={t('candidate.from')}
              value={file}
              onChange={(event) => setChosen(event.currentTarget.value)}
              data={[
                ...(file === '' ? [{ value: '', label: '—' }] : []),
                ...list.map((each) => ({
                  value: each.file,
                  label: `${each.drive} · ${dateTime(each.saved)}`,
                })),
              ]}
            />
            <NumberField
              label={t('gain.inertia')}
              unit="kg·m²"
              value={total}
              onChange={setTotal}
              above={0}
            />
            <NativeSelect
              label={t('candidate.load')}
              value={load}
              onChange={(event) => setLoad(event.currentTarget.value as typeof load)}
              data={LOADS.map((each) => ({ value: each, label: t(`load.${each}`) }))}
            />
          </div>
          <Button
            variant="filled"
            disabled={total === null || file === ''}
            loading={design.busy}
            onClick={() => void go()}
          >
            {t('candidate.design')}
          </Button>
        </>
      )}
      <ProblemNote problem={design.problem} onClose={design.clear} />
      {designs && (
        <>
          <p>{t('candidate.as', { load: known(t, 'load', designs.load) })}</p>
          <CandidateTable
            candidates={designs.rows}
            onApply={
              write.busy ? null : (candidate) => setAsked({ candidate, inertia: designs.inertia })
            }
          />
        </>
      )}
      <ProblemNote problem={write.problem} onClose={write.clear} />
      {half && (
        <>
          <p className="note fault" role="alert">
            {t('candidate.half')}
          </p>
          <UndoNote
            drive={drive}
            onUndone={() => {
              setHalf(false)
              write.clear()
              void onApplied()
            }}
          />
        </>
      )}
      {written && (
        <p className="note good">
          {t('candidate.written')} <a href={href('response', drive)}>{t('page.response')}</a>
        </p>
      )}
      {asked && (
        <Modal opened onClose={() => setAsked(null)} title={t('candidate.apply')}>
          <p>{t('notch.confirm')}</p>
          <ul className="num">
            <li>
              {t('gain.speed')}: {hertz(asked.candidate.gains.speed_bandwidth_hz)}
            </li>
            <li>
              {t('gain.integral')}: {hertz(asked.candidate.gains.integral_hz)}
            </li>
            <li>
              {t('gain.position')}: {fixed(asked.candidate.gains.position_1_s, 1, '1/s')}
            </li>
            <li>
              {t('gain.inertia')}: {amount(asked.inertia, 'kg·m²')}
            </li>
            {asked.candidate.notches.map((notch, i) => (
              <li key={i}>
                {t('notch.slot', { number: i + 1 })}:{' '}
                {`${hertz(notch.center_hz)} · ${hertz(notch.width_hz)} · ${fixed(notch.depth_db, 1, 'dB')}`}
              </li>
            ))}
          </ul>
          <div className="row end">
            <Button onClick={() => setAsked(null)}>{t('cancel')}</Button>
            <Button
              variant="filled"
              onClick={() => {
                setAsked(null)
                void apply(asked.candidate, asked.inertia)
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

/** Whether the drive's family has notches at all. */
async function documentsNotches(drive: string): Promise<boolean> {
  try {
    await ask(
      api.GET('/api/v1/drives/{drive_id}/notches', { params: { path: { drive_id: drive } } }),
    )
    return true
  } catch (error) {
    if (problemOf(error).type === NONE_DOCUMENTED) return false
    throw error
  }
}
