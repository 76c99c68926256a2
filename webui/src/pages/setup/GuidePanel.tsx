import { Button } from '@mantine/core'
import { useState } from 'react'
import type { Guide, ProcedureInfo } from '../../api/schema'
import { useT } from '../../i18n'
import { JobNote } from '../../widgets/JobNote'
import { Panel } from '../../widgets/Panel'
import { ParameterFields } from '../../widgets/ParameterFields'
import { ProcedureDialog, useProcedures } from '../../widgets/Procedures'

/** A course of the drive's manual, step by step, with the parameters and procedures of each. */
export function GuidePanel({ drive, guide }: { drive: string; guide: Guide }) {
  const t = useT()
  const procedures = useProcedures(drive)
  const [chosen, setChosen] = useState<ProcedureInfo | null>(null)
  const [job, setJob] = useState<string | null>(null)
  return (
    <Panel title={guide.title}>
      {guide.warning && <p className="note warn">{guide.warning}</p>}
      {guide.notes && <p className="dim">{guide.notes}</p>}
      <ol className="guide">
        {guide.steps.map((step, i) => {
          const procedure = procedures?.find((each) => each.name === step.procedure)
          return (
            <li key={step.title}>
              <h3>
                {t('guide.step', { n: i + 1 })}: {step.title}
              </h3>
              <p className="prose">{step.text}</p>
              {(step.keys ?? []).length > 0 && (
                <ParameterFields drive={drive} keys={step.keys ?? []} />
              )}
              {step.procedure && procedures && !procedure && (
                <p className="note info">{t('guide.noProcedure')}</p>
              )}
              {procedure && (
                <Button variant="filled" onClick={() => setChosen(procedure)}>
                  {procedure.title}: {t('guide.run')}
                </Button>
              )}
            </li>
          )
        })}
      </ol>
      <JobNote id={job} onClose={() => setJob(null)} />
      {(guide.failures ?? []).length > 0 && (
        <p>
          {t('guide.failures')}: <span className="mono">{guide.failures?.join(', ')}</span>
        </p>
      )}
      <p className="dim">{t('source', { source: guide.source })}</p>
      {chosen && (
        <ProcedureDialog
          drive={drive}
          procedure={chosen}
          onClose={() => setChosen(null)}
          onStarted={setJob}
        />
      )}
    </Panel>
  )
}
