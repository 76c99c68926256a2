import { Button } from '@mantine/core'
import { API_ROOT, api, ask } from '../../../api/client'
import { useT } from '../../../i18n'
import { useDrives } from '../../../live/store'
import { Icon } from '../../../widgets/layout/Icon'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { CyclicExchange } from './CyclicExchange'
import { LatencyTimer } from '../preflight/LatencyTimer'
import { QualityTable } from '../bench/QualityTable'
import { DoctorCard } from '../segment/DoctorCard'
import { SegmentPanel } from '../segment/SegmentPanel'
import { useBuses } from '../../../live/buses'

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
          <a
            className="download"
            href={`${API_ROOT}/api/v1/buses/flight?url=${encodeURIComponent(bus.url)}`}
            download
          >
            <Icon name="download" /> {t('segment.frames')}
          </a>
          <QualityTable quality={bus.quality} />
          <LatencyTimer url={bus.url} />
          {bus.kind === 'ethercat' && <SegmentPanel url={bus.url} />}
          {(bus.kind === 'ethercat' || bus.kind === 'canopen') && <DoctorCard url={bus.url} />}
          {bus.cyclic_possible && <CyclicExchange bus={bus} onChange={refresh} />}
        </div>
      ))}
    </Panel>
  )
}
