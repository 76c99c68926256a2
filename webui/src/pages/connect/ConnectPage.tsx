import { Button, TextInput } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { api, ask } from '../../api/client'
import type { Interfaces, MessageInfo } from '../../api/schema'
import { useSay, useT } from '../../i18n'
import { useDrives, useLink } from '../../live/store'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { BenchDrive } from './bench/BenchDrive'
import { Buses } from './buses/Buses'
import { ConnectHelp } from './ConnectHelp'
import { NotListedPanel } from './profiles/NotListed'
import { LatencyTimer } from './preflight/LatencyTimer'
import { Preflight } from './preflight/Preflight'
import { Scan } from './scan/Scan'
import { StationBox } from './bench/StationBox'
import { InterfacePermissions } from './segment/Permissions'
import { VirtualBench } from './bench/VirtualBench'

/** One way to a bus: what it is, whether it can be used, and the URL to start from. */
interface Way {
  url: string
  label: string
  kind: 'virtual' | 'serial' | 'network' | 'can'
  usable: boolean
  problem: string
  problem_message?: MessageInfo | null
}

function ways(found: Interfaces): Way[] {
  return [
    ...found.virtual.map((url) => way('virtual', url, url)),
    ...found.serial.map((port) => ({
      ...way('serial', port.url, `${port.path} ${port.description}`.trim()),
      usable: port.usable,
      problem: port.problem,
      problem_message: port.problem_message ?? null,
    })),
    ...found.network.map((card) => ({
      ...way('network', card.url, card.name),
      usable: card.usable,
      problem: card.problem,
      problem_message: card.problem_message ?? null,
    })),
    ...found.can.map((url) => way('can', url, url)),
  ]
}

function way(kind: Way['kind'], url: string, label: string): Way {
  return { kind, url, label, usable: true, problem: '' }
}

export function ConnectPage() {
  const t = useT()
  const say = useSay()
  const drives = useDrives()
  const link = useLink()
  const [interfaces, setInterfaces] = useState<Interfaces | null>(null)
  const [url, setUrl] = useState('')
  const [joining, setJoining] = useState(false)
  const load = useAction()
  const refresh = useCallback(
    () => load.run(async () => setInterfaces(await ask(api.GET('/api/v1/interfaces')))),
    [load.run],
  )
  useEffect(() => {
    if (link.open) void refresh()
  }, [link.open, refresh])
  const known = interfaces ? ways(interfaces) : []
  return (
    <div className="page">
      <h1>{t('page.connect')}</h1>
      <StationBox />
      <div className="columns">
        <Panel
          title={t('connect.interfaces')}
          tools={
            <Button loading={load.busy} onClick={() => void refresh()}>
              {t('connect.refresh')}
            </Button>
          }
        >
          <ProblemNote problem={load.problem} onClose={load.clear} />
          {interfaces && known.length === 0 && <p className="dim">{t('connect.noInterfaces')}</p>}
          <ul className="ways">
            {known.map((each) => (
              <li key={each.url}>
                <button
                  type="button"
                  className="entry"
                  aria-pressed={url === each.url}
                  onClick={() => setUrl(each.url)}
                >
                  <span className="grow">
                    {each.label}
                    <small>
                      {t(`connect.kind.${each.kind}`)}
                      {!each.usable &&
                        ` · ${say.message(each.problem_message, each.problem) || t('connect.unusable')}`}
                    </small>
                  </span>
                </button>
              </li>
            ))}
          </ul>
          <TextInput
            label={t('connect.url')}
            description={t('connect.urlHelp')}
            value={url}
            spellCheck={false}
            autoCapitalize="off"
            className="mono-input"
            onChange={(event) => setUrl(event.currentTarget.value)}
          />
          <InterfacePermissions url={url.trim()} />
          <LatencyTimer url={url.trim()} />
          <Scan url={url.trim()} onUrl={setUrl} />
        </Panel>
        <Panel title={t('connect.bench')}>
          {drives?.length === 0 && <p className="dim">{t('connect.benchEmpty')}</p>}
          {(joining || drives?.length === 0) && interfaces && interfaces.virtual.length > 0 && (
            <VirtualBench urls={interfaces.virtual} onBusy={setJoining} />
          )}
          {drives?.map((drive) => (
            <BenchDrive key={drive.id} drive={drive} />
          ))}
        </Panel>
      </div>
      <NotListedPanel />
      <Buses />
      <Preflight url={url.trim()} />
      <ConnectHelp />
    </div>
  )
}
