import '../../widgets/layout/functions.css'
import { Button, Modal, NativeSelect } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../api/client'
import type { ParameterValue, TerminalBits, TerminalInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { setReadings, useReadings } from '../../live/store'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useRows } from '../../widgets/profile-text/rows'
import { useSay } from '../../widgets/profile-text/texts'
import { useAction } from '../../widgets/requests/useAction'
import { polarityName, twins } from './terminals'

/** State of a terminal in the newest reading of the object that shows it. */
function useStates(
  drive: string,
  places: readonly TerminalBits[],
): (terminal: TerminalInfo) => boolean | null {
  const readings = useReadings(drive)
  return (terminal) => {
    const place = places.find((each) => terminal.name in each.bits)
    const raw = place && readings?.get(place.key)?.raw
    const bit = place?.bits[terminal.name]
    if (typeof raw !== 'number' || bit === undefined) return terminal.on
    return Math.floor(raw / 2 ** bit) % 2 === 1
  }
}

/** Terminals of one direction: lamp, function and polarity. */
export function TerminalTable({
  drive,
  terminals,
  states,
  onChanged,
}: {
  drive: string
  terminals: TerminalInfo[]
  states: readonly TerminalBits[]
  onChanged: () => Promise<void>
}) {
  const t = useT()
  const say = useSay(drive)
  const stateOf = useStates(drive, states)
  const write = useAction()
  const [asked, setAsked] = useState<{ terminal: TerminalInfo; code: number } | null>(null)
  const put = (key: string, raw: number) => write.run(() => store(key, raw))
  const rows = useRows(drive)
  const store = async (key: string, raw: number) => {
    const params = { path: { drive_id: drive, key } }
    const body = { raw, value: null }
    const moves = rows?.find((row) => row.key === key)?.motion === 'energises'
    const value: ParameterValue = await ask(
      // A function that jogs or enables needs the right to move, and a shaft that stands.
      moves
        ? api.PUT('/api/v1/drives/{drive_id}/motion-settings/{key}', {
            params,
            body: { ...body, reason: '' },
          })
        : api.PUT('/api/v1/drives/{drive_id}/parameters/{key}', { params, body }),
    )
    setReadings(drive, [value])
    // Until the terminals are read again, no second one can be given the same function unseen.
    await onChanged()
  }
  /** One bit of a shared parameter: the others as the drive has them now, not as last seen. */
  const putBit = (key: string, bit: number, set: boolean) =>
    write.run(async () => {
      const { raw } = await ask(
        api.GET('/api/v1/drives/{drive_id}/parameters/{key}', {
          params: { path: { drive_id: drive, key } },
        }),
      )
      if (typeof raw !== 'number') return
      const now = Math.floor(raw / 2 ** bit) % 2 === 1
      if (now !== set) await store(key, raw + (set ? 1 : -1) * 2 ** bit)
      else await onChanged()
    })
  const choose = (terminal: TerminalInfo, code: number) => {
    if (terminal.function_key === null) return
    if (terminal.direction === 'in' && twins(terminals, terminal, code).length > 0)
      setAsked({ terminal, code })
    else void put(terminal.function_key, code)
  }
  return (
    <>
      <ul className="terminals">
        {terminals.map((terminal) => {
          const on = stateOf(terminal)
          return (
            <li key={terminal.name} className={on ? 'on' : ''}>
              <div className="terminal-head">
                <span className="lamp" aria-hidden="true">
                  {on ? '●' : '○'}
                </span>
                <strong>{terminal.name}</strong>
                <span>{on === null ? '—' : t(on ? 'io.on' : 'io.off')}</span>
                {terminal.function_key === null && (
                  <small className="dim">{t('io.noFunction')}</small>
                )}
              </div>
              <div className="terminal-set">
                {terminal.function_key !== null && terminal.functions.length > 0 && (
                  <NativeSelect
                    className="grow"
                    aria-label={t('io.function', { name: terminal.name })}
                    disabled={write.busy}
                    value={terminal.function === null ? '' : String(terminal.function)}
                    onChange={(event) => choose(terminal, Number(event.currentTarget.value))}
                    data={choices(terminal, say)}
                  />
                )}
                <Polarity
                  drive={drive}
                  terminal={terminal}
                  busy={write.busy}
                  put={put}
                  putBit={putBit}
                />
              </div>
              {terminal.same_function.length > 0 && (
                <p className={terminal.direction === 'in' ? 'note warn' : 'dim'}>
                  {t('io.twin', { names: terminal.same_function.join(', ') })}
                </p>
              )}
              {terminal.notes && (
                <p className="dim">
                  <ProfileText drive={drive} text={terminal.notes} />
                </p>
              )}
            </li>
          )
        })}
      </ul>
      <ProblemNote problem={write.problem} onClose={write.clear} />
      {asked && (
        <Modal
          opened
          onClose={() => setAsked(null)}
          title={t('io.function', { name: asked.terminal.name })}
        >
          <p>
            {t('io.twinAsk', {
              name: asked.terminal.name,
              names: twins(terminals, asked.terminal, asked.code).join(', '),
            })}
          </p>
          <div className="row end">
            <Button onClick={() => setAsked(null)}>{t('cancel')}</Button>
            <Button
              variant="filled"
              onClick={() => {
                const { terminal, code } = asked
                setAsked(null)
                if (terminal.function_key !== null) void put(terminal.function_key, code)
              }}
            >
              {t('io.writeAnyway')}
            </Button>
          </div>
        </Modal>
      )}
    </>
  )
}

function choices(
  terminal: TerminalInfo,
  say: (text: string) => string,
): { value: string; label: string }[] {
  const known = terminal.functions.map((each) => ({
    value: String(each.code),
    label: `${each.code} · ${say(each.name)}`,
  }))
  const now = terminal.function
  if (now === null) return [{ value: '', label: '—' }, ...known]
  if (terminal.functions.some((each) => each.code === now)) return known
  return [{ value: String(now), label: String(now) }, ...known]
}

function Polarity({
  drive,
  terminal,
  busy,
  put,
  putBit,
}: {
  drive: string
  terminal: TerminalInfo
  busy: boolean
  put: (key: string, raw: number) => Promise<boolean>
  putBit: (key: string, bit: number, set: boolean) => Promise<boolean>
}) {
  const t = useT()
  const key = terminal.polarity_key
  const row = (useRows(drive) ?? []).find((each) => each.key === key)
  const raw = useReadings(drive)?.get(key ?? '')?.raw ?? row?.reading.raw ?? null
  if (key === null || !row?.reachable || typeof raw !== 'number') return null
  const label = t('io.polarity', { name: terminal.name })
  const bit = terminal.polarity_bit
  if (bit === null) {
    return (
      <NativeSelect
        aria-label={label}
        disabled={busy}
        value={String(raw)}
        onChange={(event) => void put(key, Number(event.currentTarget.value))}
        data={Object.entries(row.enum).map(([value, text]) => ({ value, label: text }))}
      />
    )
  }
  const set = Math.floor(raw / 2 ** bit) % 2 === 1
  const named = row.bits[String(bit)]
  return (
    <NativeSelect
      aria-label={label}
      disabled={busy}
      title={named ?? ''}
      value={set ? '1' : '0'}
      onChange={(event) => void putBit(key, bit, event.currentTarget.value === '1')}
      data={[
        { value: '0', label: polarityName(named, 0) ?? t('io.positive') },
        { value: '1', label: polarityName(named, 1) ?? t('io.inverted') },
      ]}
    />
  )
}
