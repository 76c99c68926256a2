import { Button, NativeSelect } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { Bus } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { Said } from '../../../widgets/messages/Said'
import { useAction } from '../../../widgets/requests/useAction'

const CYCLES_US = [250, 500, 1000, 2000, 4000, 8000]

/** Process data of a bus: whether it is exchanged, how, and what did not fit. */
export function CyclicExchange({ bus, onChange }: { bus: Bus; onChange: () => Promise<void> }) {
  const t = useT()
  const [cycle, setCycle] = useState(1000)
  const act = useAction()
  const start = () =>
    act.run(async () => {
      await ask(api.POST('/api/v1/buses/cyclic', { body: { url: bus.url, cycle_us: cycle } }))
      await onChange()
    })
  const stop = () =>
    act.run(async () => {
      await ask(api.DELETE('/api/v1/buses/cyclic', { params: { query: { url: bus.url } } }))
      await onChange()
    })
  const now = bus.cyclic
  const left = Object.entries(now?.left_over ?? {})
  return (
    <div className="cyclic">
      <div className="row wrap middle">
        <h3>{t('cyclic.title')}</h3>
        {now?.running ? (
          <>
            <span className="grow num">
              {[
                t('cyclic.on', { cycle: now.cycle_us }),
                now.dc !== null && t(now.dc ? 'cyclic.dc' : 'cyclic.noDc'),
                t('cyclic.channels', { count: now.channels.length }),
              ]
                .filter(Boolean)
                .join(' · ')}
            </span>
            <Button loading={act.busy} onClick={() => void stop()}>
              {t('cyclic.stop')}
            </Button>
          </>
        ) : now?.problem ? (
          <>
            <span className="grow warn-text" role="status">
              {t('segment.recovering')} <Said message={now.problem_message} words={now.problem} />
            </span>
            <Button loading={act.busy} onClick={() => void stop()}>
              {t('segment.endRecovery')}
            </Button>
          </>
        ) : (
          <>
            <span className="grow dim">{t('cyclic.off')}</span>
            <NativeSelect
              aria-label={t('cyclic.cycle')}
              value={String(cycle)}
              onChange={(event) => setCycle(Number(event.currentTarget.value))}
              data={CYCLES_US.map((each) => ({ value: String(each), label: `${each} µs` }))}
            />
            <Button variant="filled" loading={act.busy} onClick={() => void start()}>
              {t('cyclic.start')}
            </Button>
          </>
        )}
      </div>
      {left.length > 0 && (
        <details>
          <summary>{t('cyclic.leftOver', { count: left.length })}</summary>
          <ul className="scroll-list">
            {left.map(([channel, why]) => (
              <li key={channel}>
                <span className="mono">{channel}</span>{' '}
                <Said message={now?.left_over_messages?.[channel]} words={why} />
              </li>
            ))}
          </ul>
        </details>
      )}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}
