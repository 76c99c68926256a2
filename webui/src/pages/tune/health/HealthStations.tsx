import { Button, NativeSelect } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { AxisHealth } from '../../../api/schema'
import { useT } from '../../../i18n'
import { dateTime } from '../../../widgets/numbers/format'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { HealthTrend } from './HealthTrend'
import { stateOf } from './health'

/** All axes of the database, whichever station measured them: their condition and their trend. */
export function HealthStations() {
  const t = useT()
  const [axes, setAxes] = useState<AxisHealth[] | null>(null)
  const [chosen, setChosen] = useState('')
  const read = useAction()
  const refresh = () => read.run(async () => setAxes(await ask(api.GET('/api/v1/health/trend'))))
  const one = axes?.find((each) => each.key === chosen)
  return (
    <details onToggle={(event) => event.currentTarget.open && axes === null && void refresh()}>
      <summary>{t('health.stations')}</summary>
      <ProblemNote problem={read.problem} onClose={read.clear} />
      {axes !== null && axes.length === 0 && <p className="dim">{t('health.noneStored')}</p>}
      {axes !== null && axes.length > 0 && (
        <>
          <div className="scroll-table">
            <table className="reported-values" aria-label={t('health.stations')}>
              <thead>
                <tr>
                  <th>{t('health.axis')}</th>
                  <th>{t('health.station')}</th>
                  <th>{t('health.newest')}</th>
                  <th>{t('health.state')}</th>
                </tr>
              </thead>
              <tbody className="num">
                {axes.map((each) => (
                  <tr key={each.key}>
                    <td>
                      {each.axis} <span className="dim">{each.profile}</span>
                    </td>
                    <td>{[...new Set(each.runs.map((run) => run.station))].join(', ')}</td>
                    <td>{each.runs.at(-1) ? dateTime(each.runs.at(-1)?.taken ?? '') : ''}</td>
                    <td>{t(`health.state.${stateOf(each)}`)}</td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
          <div className="row wrap">
            <NativeSelect
              label={t('health.trendOf')}
              value={chosen}
              onChange={(event) => setChosen(event.currentTarget.value)}
              data={[
                { value: '', label: '–' },
                ...axes.map((each) => ({ value: each.key, label: `${each.axis} (${each.key})` })),
              ]}
            />
            <Button variant="default" loading={read.busy} onClick={() => void refresh()}>
              {t('health.readAgain')}
            </Button>
          </div>
          {one && one.runs.length > 0 && <HealthTrend runs={one.runs} />}
        </>
      )}
    </details>
  )
}
