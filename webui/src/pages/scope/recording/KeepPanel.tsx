import { ActionIcon, Button, Textarea, TextInput } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { ScopeSetup } from '../../../api/schema'
import { useT } from '../../../i18n'
import { csvText } from '../../../live/scope/csv-text'
import * as live from '../../../live/live'
import { dateTime } from '../../../widgets/numbers/format'
import { Icon } from '../../../widgets/layout/Icon'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { offerDownload } from '../../../widgets/browser/download'
import type { PanelProps } from '../panels'
import type { Reference } from './references'
import { loadSnapshot, packSnapshot, storeSnapshot } from './snapshot'
import { useStored } from '../useScope'

const fileName = () => new Date().toISOString().slice(0, 19).replace('T', ' ').replaceAll(':', '.')

/** Reference traces, snapshots with notes, and named set-ups on the server. */
export function KeepPanel({
  shown,
  stretch,
  setup,
  references,
  onReferences,
  onSetup,
}: PanelProps & {
  setup: ScopeSetup
  references: Reference[]
  onReferences: (references: Reference[]) => void
  onSetup: (setup: ScopeSetup) => void
}) {
  const t = useT()
  const act = useAction()
  const stored = useStored()
  const [name, setName] = useState('')
  const [notes, setNotes] = useState('')
  const [setupName, setSetupName] = useState('')
  const samples = async () => {
    const over = stretch()
    if (!over) return null
    const ids = shown.map((each) => each.id)
    return { ...over, samples: await live.askScope('samples', { ...over, ids }) }
  }
  const keepReference = () =>
    act.run(async () => {
      const now = await samples()
      if (!now) return
      const label = t('keep.reference', { number: references.length + 1 })
      onReferences([
        ...references,
        ...shown.flatMap((each, i): Reference[] => {
          const found = now.samples[i]
          if (!found || found.times.length === 0) return []
          const times = found.times.map((time) => time - now.origin)
          return [{ label: `${label} ${each.label}`, unit: each.unit, times, values: found.values }]
        }),
      ])
    })
  const takeSnapshot = () =>
    act.run(async () => {
      const now = await samples()
      if (!now) return
      const created = new Date().toISOString()
      const head = { notes, origin_s: now.origin, setup, created }
      const traces = shown.map(({ label, unit, synchronous }) => ({
        label,
        unit,
        synchronous: synchronous === true,
      }))
      await storeSnapshot(name || fileName(), packSnapshot(head, traces, now.samples))
      setName('')
      setNotes('')
      await stored.refresh()
    })
  const open = (file: string) =>
    act.run(async () => {
      const { header, samples: all } = await loadSnapshot(file)
      onReferences([
        ...references,
        ...header.traces.map(({ label, unit }, i): Reference => {
          const { times, values } = all[i] ?? {
            times: new Float64Array(),
            values: new Float64Array(),
          }
          const since = times.map((time) => time - header.origin_s)
          return { label: `${file.replace('.sdsnap', '')}: ${label}`, unit, times: since, values }
        }),
      ])
    })
  const saveCsv = (file: string) =>
    act.run(async () => {
      const { header, samples: all } = await loadSnapshot(file)
      const lines = ['trace,unit,time_s,value']
      for (const [i, { label, unit }] of header.traces.entries()) {
        const quoted = [label, unit].map(csvText).join(',')
        const { times, values } = all[i] ?? {
          times: new Float64Array(),
          values: new Float64Array(),
        }
        for (const [n, time] of times.entries()) {
          lines.push(`${quoted},${(time - header.origin_s).toFixed(6)},${values[n]}`)
        }
      }
      offerDownload(file.replace('.sdsnap', '.csv'), [`${lines.join('\r\n')}\r\n`], 'text/csv')
    })
  const remove = (what: 'setups' | 'snapshots', which: string) =>
    act.run(async () => {
      await ask(api.DELETE(`/api/v1/scope/${what}/{name}`, { params: { path: { name: which } } }))
      await stored.refresh()
    })
  return (
    <section aria-label={t('scope.tab.keep')} className="columns">
      <ProblemNote problem={act.problem ?? stored.problem} onClose={act.clear} />
      <div>
        <h3>{t('keep.references')}</h3>
        <div className="row wrap">
          <Button onClick={() => void keepReference()} disabled={shown.length === 0}>
            {t('keep.keepReference')}
          </Button>
          {references.length > 0 && (
            <Button onClick={() => onReferences([])}>{t('keep.clear')}</Button>
          )}
        </div>
        <ul className="kept-list">
          {references.map((each, i) => (
            <li key={i} className="row middle">
              <span className="grow">{each.label}</span>
              <ActionIcon
                aria-label={t('keep.removeReference', { name: each.label })}
                onClick={() => onReferences(references.filter((_, n) => n !== i))}
              >
                <Icon name="cross" />
              </ActionIcon>
            </li>
          ))}
        </ul>
      </div>
      <div>
        <h3>{t('keep.snapshots')}</h3>
        <TextInput
          label={t('keep.snapshotName')}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Textarea
          label={t('recordings.notes')}
          value={notes}
          maxLength={4000}
          onChange={(event) => setNotes(event.currentTarget.value)}
        />
        <div className="row">
          <Button loading={act.busy} onClick={() => void takeSnapshot()} disabled={!shown.length}>
            {t('keep.takeSnapshot')}
          </Button>
        </div>
        <ul className="kept-list">
          {stored.snapshots.map((each) => (
            <li key={each.name} className="row wrap middle">
              <span className="grow">
                <strong>{each.name.replace('.sdsnap', '')}</strong>{' '}
                <span className="dim">
                  {each.header ? dateTime(each.header.created) : t('keep.unusable')}
                </span>
                {each.header?.notes && <span className="notes">{each.header.notes}</span>}
              </span>
              {each.header && (
                <>
                  <Button onClick={() => void open(each.name)}>{t('keep.show')}</Button>
                  <Button onClick={() => void saveCsv(each.name)}>{t('scope.csv')}</Button>
                  <Button onClick={() => each.header && onSetup(each.header.setup)}>
                    {t('keep.itsSetup')}
                  </Button>
                </>
              )}
              <ActionIcon
                aria-label={t('recordings.delete', { name: each.name })}
                onClick={() => void remove('snapshots', each.name)}
              >
                <Icon name="cross" />
              </ActionIcon>
            </li>
          ))}
        </ul>
      </div>
      <div>
        <h3>{t('keep.setups')}</h3>
        <div className="row">
          <TextInput
            className="grow"
            label={t('keep.setupName')}
            value={setupName}
            onChange={(event) => setSetupName(event.currentTarget.value)}
          />
          <Button
            disabled={setupName.trim() === ''}
            loading={act.busy}
            onClick={() =>
              void act.run(async () => {
                await ask(
                  api.PUT('/api/v1/scope/setups/{name}', {
                    params: { path: { name: setupName.trim() } },
                    body: setup,
                  }),
                )
                setSetupName('')
                await stored.refresh()
              })
            }
          >
            {t('keep.saveSetup')}
          </Button>
        </div>
        <ul className="kept-list">
          {stored.setups.map((each) => (
            <li key={each.name} className="row middle">
              <span className="grow">{each.name}</span>
              <Button
                aria-label={t('keep.useSetup', { name: each.name })}
                onClick={() => onSetup(each.setup)}
              >
                {t('keep.use')}
              </Button>
              <ActionIcon
                aria-label={t('recordings.delete', { name: each.name })}
                onClick={() => void remove('setups', each.name)}
              >
                <Icon name="cross" />
              </ActionIcon>
            </li>
          ))}
        </ul>
      </div>
    </section>
  )
}
