import { Button } from '@mantine/core'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import { useDrives } from '../../live/store'
import { Panel } from '../../widgets/Panel'
import { ProblemNote } from '../../widgets/ProblemNote'
import { useAction } from '../../widgets/useAction'
import { CyclicExchange } from './CyclicExchange'
import { QualityTable } from './QualityTable'
import { SegmentPanel } from './segment/SegmentPanel'
import { useBuses } from './useBuses'

/** Opened buses and how well they work. */
export function Buses() {
  const t = useT()
  const drives = useDrives() ?? []
  const { buses, refresh } = useBuses()
  const close = useAction()
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
          {bus.kind === 'ethercat' && <SegmentPanel url={bus.url} />}
          {bus.cyclic_possible && <CyclicExchange bus={bus} onChange={refresh} />}
        </div>
      ))}
    </Panel>
  )
}
