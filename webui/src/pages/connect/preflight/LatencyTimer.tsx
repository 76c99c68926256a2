import { Button } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { LatencyTimerInfo } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { serialPortOf } from './preflight'

/** For how long the adapter of a URL holds answers back; lowered and restored by a press. */
export function LatencyTimer({ url }: { url: string }) {
  const device = serialPortOf(url)
  const [info, setInfo] = useState<LatencyTimerInfo | null>(null)
  const action = useAction()
  const { run } = action
  useEffect(() => {
    setInfo(null)
    if (!device) return
    let wanted = true
    ask(api.GET('/api/v1/adapters/latency-timer', { params: { query: { device } } })).then(
      (found) => wanted && setInfo(found),
      () => {},
    )
    return () => {
      wanted = false
    }
  }, [device])
  if (!info || info.ms === null) return null
  const lower = () =>
    run(async () =>
      setInfo(
        await ask(
          api.PUT('/api/v1/adapters/latency-timer', { body: { device, ms: info.lowered_ms } }),
        ),
      ),
    )
  const restore = () =>
    run(async () =>
      setInfo(
        await ask(api.DELETE('/api/v1/adapters/latency-timer', { params: { query: { device } } })),
      ),
    )
  return (
    <Timer
      info={info}
      busy={action.busy}
      onLower={() => void lower()}
      onRestore={() => void restore()}
    >
      <ProblemNote problem={action.problem} onClose={action.clear} />
    </Timer>
  )
}

function Timer({
  info,
  busy,
  onLower,
  onRestore,
  children,
}: {
  info: LatencyTimerInfo
  busy: boolean
  onLower: () => void
  onRestore: () => void
  children: React.ReactNode
}) {
  const t = useT()
  const ms = info.ms ?? 0
  const high = ms > info.lowered_ms
  return (
    <div className={`note ${high ? 'warn' : 'good'}`} role="status">
      <p>
        {t('latency.is', { device: info.device, ms })}{' '}
        {t('latency.bound', { reads: Math.floor(info.reads_at_most ?? 0) })}
      </p>
      {info.reads_measured !== null && (
        <p>{t('latency.measured', { reads: Math.round(info.reads_measured) })}</p>
      )}
      {info.before_ms !== null && (
        <p>
          {t('latency.before', { ms: info.before_ms })}{' '}
          {info.reads_before !== null &&
            t('latency.measuredBefore', { reads: Math.round(info.reads_before) })}
        </p>
      )}
      {info.in_force === 'after_replug' && <p>{t('latency.replug', { device: info.device })}</p>}
      {children}
      {high && (
        <p className="dim">
          {t('latency.gain', {
            ms: info.lowered_ms,
            reads: Math.floor(info.lowered_reads_at_most),
          })}{' '}
          {info.restarts && t('latency.restarts')}
        </p>
      )}
      <div className="row">
        {high && (
          <Button loading={busy} onClick={onLower}>
            {t('latency.lower', { ms: info.lowered_ms })}
          </Button>
        )}
        {info.before_ms !== null && (
          <Button loading={busy} onClick={onRestore}>
            {t('latency.restore', { ms: info.before_ms })}
          </Button>
        )}
      </div>
    </div>
  )
}
