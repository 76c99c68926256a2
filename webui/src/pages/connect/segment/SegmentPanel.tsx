import './segment.css'
import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import { useT } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { Said } from '../../../widgets/messages/Said'
import { useAction } from '../../../widgets/requests/useAction'
import { Lateness } from './Lateness'
import { places } from './layout'
import { Permissions } from './Permissions'
import { SegmentPicture } from './SegmentPicture'
import { StationPanel } from './StationPanel'
import { useSegment } from './useSegment'

/** An EtherCAT segment: picture, what its counters accuse, punctuality, and each slave. */
export function SegmentPanel({ url }: { url: string }) {
  const t = useT()
  const { segment, refresh } = useSegment(url)
  const [chosen, setChosen] = useState<number | null>(null)
  const clear = useAction()
  if (!segment) return null
  const found = places(segment.stations)
  const station = segment.stations.find((each) => each.station === chosen)
  const sentences = [
    ...new Set([
      ...segment.stations.flatMap((each) => each.ports.flatMap((port) => port.findings)),
      ...segment.stations.flatMap((each) => each.findings),
    ]),
  ]
  const broken = found.filter((place) => place.cable === 'broken')
  const clearCounters = () =>
    clear.run(async () => {
      await ask(api.POST('/api/v1/ethercat/counters/clear', { body: { url } }))
      await refresh()
    })
  return (
    <div className="segment">
      <h3>{t('segment.title')}</h3>
      {segment.problem !== '' && (
        <p className="note fault">
          <Said message={segment.problem_message} words={segment.problem} />
        </p>
      )}
      {segment.permissions &&
        (!segment.permissions.ready || segment.permissions.missing.length > 0) && (
          <Permissions report={segment.permissions} />
        )}
      {segment.stations.length === 0 ? (
        <p className="dim">{t('segment.empty')}</p>
      ) : (
        <SegmentPicture
          stations={segment.stations}
          chosen={chosen}
          onChoose={(next) => setChosen(next === chosen ? null : next)}
        />
      )}
      {broken.map(({ station: lost }) => (
        <p key={lost.station} className="note fault" role="alert">
          {lost.behind_station === 0
            ? t('segment.brokenFirst', { station: lost.station })
            : t('segment.brokenBetween', { before: lost.behind_station, station: lost.station })}
        </p>
      ))}
      {sentences.length > 0 && (
        <>
          <ul className="warn-text">
            {sentences.map((sentence) => (
              <li key={sentence}>{sentence}</li>
            ))}
          </ul>
          <Button loading={clear.busy} onClick={() => void clearCounters()}>
            {t('segment.clear')}
          </Button>
        </>
      )}
      <ProblemNote problem={clear.problem} onClose={clear.clear} />
      {station ? (
        <StationPanel url={url} station={station} />
      ) : (
        segment.stations.length > 0 && <p className="dim">{t('segment.choose')}</p>
      )}
      {segment.exchange && <Lateness exchange={segment.exchange} />}
      {segment.real_time.length > 0 && (
        <details>
          <summary>{t('segment.realTime')}</summary>
          <ul>
            {segment.real_time.map((note, place) => (
              <li key={note}>
                <Said message={segment.real_time_messages[place]} words={note} />
              </li>
            ))}
          </ul>
        </details>
      )}
    </div>
  )
}
