import { type ReactNode, useEffect, useMemo, useState } from 'react'
import { type ToolSettings, startTool } from '../../../../api/tools'
import { useT } from '../../../../i18n'
import { setJob } from '../../../../live/store'
import { JobNote } from '../../../../widgets/jobs/JobNote'
import { Panel } from '../../../../widgets/layout/Panel'
import { ProblemNote } from '../../../../widgets/messages/ProblemNote'
import { StartButton } from '../../../../widgets/jobs/StartButton'
import { useAction } from '../../../../widgets/requests/useAction'
import { useWrong } from '../../../../widgets/numbers/useWrong'
import type { Limits } from '../../../response/plot/limits'
import { useToolJob } from '../../../response/useToolJob'
import { complete, fieldsOf, initialValues, ToolForm, useTool, type Values } from './ToolForm'

/** What the page hands to each tool that measures a drive. */
export interface Measured {
  drive: string
  /** null: none are permitted yet. */
  limits: Limits | null
  /** What is in the way of a measurement, as text. */
  obstacle: string | null
  cycleMs: number
}

const NONE: readonly string[] = []

/**
 * A tool on a drive: its description and texts from the server, the values of its form, its newest
 * job, and what starts it. `stated` names fields that a person states for one run: each new job
 * clears them. `initial` replaces defaults of the server.
 */
export function useToolRun(
  kind: keyof ToolSettings,
  drive: string,
  { stated = NONE, initial }: { stated?: readonly string[]; initial?: Values } = {},
) {
  const { tool, text } = useTool(kind)
  const fields = useMemo(() => (tool ? fieldsOf(tool.settings) : []), [tool])
  const [values, setValues] = useState<Values>({})
  const wrong = useWrong()
  const { job, note, dismiss } = useToolJob(drive, kind)
  const start = useAction()
  const begun = job?.id ?? ''
  useEffect(() => setValues({ ...initialValues(fields), ...initial }), [fields, drive])
  useEffect(() => {
    if (stated.length === 0) return
    setValues((old) => ({ ...old, ...Object.fromEntries(stated.map((name) => [name, false])) }))
  }, [begun])
  const begin = (settings: object) =>
    void start.run(async () =>
      setJob(await startTool(kind, drive, settings as ToolSettings[typeof kind])),
    )
  return { tool, text, fields, values, setValues, wrong, job, note, dismiss, start, begin }
}

type ToolRun = ReturnType<typeof useToolRun>

/** A tool's panel: lead, what starts it, how its job goes, and its answer. */
export function ToolPanel({
  run,
  children,
  answer,
}: {
  run: ToolRun
  children: ReactNode
  answer: ReactNode
}) {
  const { text, start } = run
  if (!run.tool) return null
  return (
    <Panel title={text('title')}>
      <p className="dim">{text('lead')}</p>
      {children}
      <ProblemNote problem={start.problem} onClose={start.clear} />
      <JobNote id={run.note} onClose={run.dismiss} />
      {answer}
    </Panel>
  )
}

/** The form of a tool and the button that starts it. */
export function ToolStart({
  run,
  limits = null,
  obstacle,
  missing = null,
  without,
  busy = false,
  label = 'start',
  warning,
  onStart,
}: {
  run: ToolRun
  /** null: none are permitted yet, or the tool has its own. */
  limits?: Limits | null
  obstacle: string | null
  /** What is not stated yet next to the form, as text. */
  missing?: string | null
  /** A field that does not count now. */
  without?: string
  busy?: boolean
  label?: string
  /** Stands between the form and the button. */
  warning?: ReactNode
  onStart: () => void
}) {
  const t = useT()
  const { tool, text, fields, values, setValues, wrong, start } = run
  if (!tool) return null
  return (
    <>
      <ToolForm
        tool={tool}
        limits={limits}
        fields={fields.filter((each) => each.name !== without)}
        values={values}
        wrong={wrong}
        text={text}
        onChange={setValues}
      />
      {warning}
      <StartButton
        obstacle={
          obstacle ?? (complete(fields, values) && !wrong.any ? missing : t('start.incomplete'))
        }
        busy={start.busy || busy}
        onStart={onStart}
      >
        {text(label)}
      </StartButton>
    </>
  )
}

/** The start of a measurement within the limits, with what the panel asks for by itself. */
export function MeasuredStart({
  run,
  measured: { limits, obstacle, cycleMs },
  asked = {},
  ...rest
}: {
  run: ToolRun
  measured: Measured
  asked?: object
  missing?: string | null
  warning?: ReactNode
}) {
  const go = () => limits && run.begin({ ...limits, cycle_ms: cycleMs, ...run.values, ...asked })
  return <ToolStart {...rest} run={run} limits={limits} obstacle={obstacle} onStart={go} />
}
