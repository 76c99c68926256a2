import { Button } from '@mantine/core'
import { useState } from 'react'
import { api, ask } from '../../../api/client'
import type { DoctorFact, StationDiagnosis } from '../../../api/schema'
import { useLanguage, useT, type T } from '../../../i18n'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { TrialList } from './TrialList'

/** Why stations of a bus are not in Operational: causes with evidence, the likeliest first. */
export function DoctorCard({ url }: { url: string }) {
  const t = useT()
  const chinese = useLanguage() === 'zh'
  const [found, setFound] = useState<StationDiagnosis[] | null>(null)
  const examine = useAction()
  const look = async () => {
    setFound(await ask(api.GET('/api/v1/buses/doctor', { params: { query: { url } } })))
  }
  return (
    <section aria-label={t('segment.doctor')}>
      <Button loading={examine.busy} onClick={() => void examine.run(look)}>
        {t('segment.doctor')}
      </Button>
      <ProblemNote problem={examine.problem} onClose={examine.clear} />
      {found?.map((each) => (
        <div key={each.station}>
          <h4>{t('segment.doctorStation', { station: each.station })}</h4>
          {each.reached ? (
            <p>{t('segment.doctorWell')}</p>
          ) : (
            <ol>
              {each.causes.map((cause) => (
                <li key={cause.code}>
                  <strong>{chinese ? cause.title_zh : cause.title}</strong>
                  <p>{chinese ? cause.remedy_zh : cause.remedy}</p>
                  <ul className="plain-list dim num">
                    {cause.facts.map((fact) => (
                      <li key={fact.name}>{factText(t, fact, chinese)}</li>
                    ))}
                  </ul>
                </li>
              ))}
            </ol>
          )}
          <TrialList url={url} diagnosis={each} onChanged={look} />
        </div>
      ))}
    </section>
  )
}

function factText(t: T, fact: DoctorFact, chinese: boolean): string {
  const name = chinese ? fact.label_zh : fact.label
  return fact.shown_expected === null
    ? t('segment.doctorFactAlone', { name, actual: fact.shown })
    : t('segment.doctorFact', { name, actual: fact.shown, expected: fact.shown_expected })
}
