import { Button } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Bus } from '../../api/schema'
import { useT } from '../../i18n'
import { useDrives, useLink } from '../../live/store'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useAction } from '../../widgets/useAction'
import { QualityTable } from './QualityTable'

const PERIOD_MS = 2000

/** Opened buses and how well they work. */
export function Buses() {
  const t = useT()
  const link = useLink()
  const drives = useDrives() ?? []
  const [buses, setBuses] = useState<Bus[]>([])
  const close = useAction()
  const refresh = useCallback(async () => {
    try {
      setBuses(await ask(api.GET('/api/v1/buses')))
    } catch {
      // Shown by the connection banner; the next round tries again.
    }
  }, [])
  useEffect(() => {
    if (!link.open) return
    void refresh()
    const timer = setInterval(() => void refresh(), PERIOD_MS)
    return () => clearInterval(timer)
  }, [link.open, refresh])
  if (buses.length === 0) return null
  const used = new Set(drives.flatMap((drive) => drive.ports.map((port) => port.url)))
  return (
    <Panel title={t('connect.buses')}>
      <ProblemNote problem={close.problem} onClose={close.clear} />
      {buses.map((bus) => (
        <div key={bus.url} className="bus">
          <div className="row middle">
            <strong className="mono grow">{bus.url}</strong>
            {!used.has(bus.url) && (
              <Button
                loading={close.busy}
                onClick={() =>
                  void close.run(async () => {
                    await ask(api.DELETE('/api/v1/buses', { params: { query: { url: bus.url } } }))
                    await refresh()
                  })
                }
              >
                {t('connect.closeBus')}
              </Button>
            )}
          </div>
          <QualityTable quality={bus.quality} />
        </div>
      ))}
    </Panel>
  )
}
