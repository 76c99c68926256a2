import { Button, Checkbox, FileButton } from '@mantine/core'
import { useState } from 'react'
import { API_ROOT, api, ask } from '../../../api/client'
import type { EepromPlan, SegmentStation } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'

type What = 'restore' | 'identity'

/** The EEPROM of one slave: saved to a file, compared with one, restored after two confirmations. */
export function Eeprom({ url, station }: { url: string; station: SegmentStation }) {
  const t = useT()
  const [file, setFile] = useState<File | null>(null)
  const [what, setWhat] = useState<What>('restore')
  const [plan, setPlan] = useState<EepromPlan | null>(null)
  const [saved, setSaved] = useState(false)
  const [sure, setSure] = useState(false)
  const [unknown, setUnknown] = useState(false)
  const [written, setWritten] = useState(false)
  const action = useAction()
  const place = { url, station: station.station }
  const forget = () => {
    setPlan(null)
    setSaved(false)
    setSure(false)
    setWritten(false)
  }
  const body = (chosen: File | null) => ({
    body: (chosen ?? '') as unknown as string,
    bodySerializer: (data: unknown) => data as BodyInit,
    headers: { 'Content-Type': 'application/octet-stream' },
  })
  const look = (next: What, chosen: File | null, accepted: boolean) =>
    action.run(async () => {
      forget()
      setWhat(next)
      setPlan(
        await ask(
          api.POST('/api/v1/ethercat/eeprom/plan', {
            params: { query: { ...place, what: next, unknown_accepted: accepted } },
            ...body(chosen),
          }),
        ),
      )
    })
  const write = () =>
    action.run(async () => {
      if (!plan) return
      await ask(
        api.POST('/api/v1/ethercat/eeprom/restore', {
          params: {
            query: {
              ...place,
              what,
              digest: plan.digest,
              unknown_accepted: unknown,
              confirmed: saved && sure,
            },
          },
          ...body(what === 'restore' ? file : null),
        }),
      )
      forget()
      setWritten(true)
    })
  const query = new URLSearchParams({ url, station: String(station.station) })
  const address = `${API_ROOT}/api/v1/ethercat/eeprom?${query}`
  return (
    <details>
      <summary>{t('segment.eeprom')}</summary>
      <p className="prose">{t('segment.eepromWhat')}</p>
      <div className="row">
        <Button component="a" href={address} download>
          {t('segment.eepromSave')}
        </Button>
        <FileButton
          onChange={(chosen) => {
            setFile(chosen)
            if (chosen) void look('restore', chosen, unknown)
          }}
        >
          {(props) => <Button {...props}>{t('segment.eepromChoose')}</Button>}
        </FileButton>
        <Button loading={action.busy} onClick={() => void look('identity', null, false)}>
          {t('segment.eepromIdentity')}
        </Button>
      </div>
      <Checkbox
        label={t('segment.eepromUnknown')}
        checked={unknown}
        onChange={(event) => {
          setUnknown(event.currentTarget.checked)
          if (file) void look('restore', file, event.currentTarget.checked)
        }}
      />
      {plan?.changes.length === 0 && <p className="note good">{t('segment.eepromSame')}</p>}
      {plan && plan.changes.length > 0 && (
        <>
          <table className="plain num" aria-label={t('segment.eepromChanges')}>
            <thead>
              <tr>
                <th>{t('segment.eepromField')}</th>
                <th>{t('segment.eepromNow')}</th>
                <th>{t('segment.eepromThen')}</th>
              </tr>
            </thead>
            <tbody>
              {plan.changes.map((each) => (
                <tr key={`${each.word} ${each.field}`}>
                  <td>{each.field}</td>
                  <td className="mono">{short(each.first)}</td>
                  <td className="mono">{short(each.second)}</td>
                </tr>
              ))}
            </tbody>
          </table>
          {plan.keeps_serial && <p className="dim">{t('segment.eepromSerial')}</p>}
          <p className="note warn">{t('segment.eepromWarning', { words: plan.words })}</p>
          <Checkbox
            label={t('segment.eepromSaved')}
            checked={saved}
            onChange={(event) => setSaved(event.currentTarget.checked)}
          />
          <Checkbox
            label={t('segment.eepromSure')}
            checked={sure}
            onChange={(event) => setSure(event.currentTarget.checked)}
          />
          <Button disabled={!saved || !sure} loading={action.busy} onClick={() => void write()}>
            {t('segment.eepromWrite')}
          </Button>
        </>
      )}
      {written && <p className="note good">{t('segment.eepromWritten')}</p>}
      <ProblemNote problem={action.problem} onClose={action.clear} />
    </details>
  )
}

function short(data: string | null): string {
  if (data === null) return '—'
  return data.length > 32 ? `${data.slice(0, 32)}… (${data.length / 2} B)` : data
}
