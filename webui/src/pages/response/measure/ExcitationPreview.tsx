import { useMemo } from 'react'
import { api, ask } from '../../../api/client'
import type { ExcitationInfo, SweepRequest } from '../../../api/schema'
import { useT } from '../../../i18n'
import { figure } from '../../../widgets/numbers/format'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAnswer } from '../../../widgets/requests/useAnswer'
import { TRACE_COLORS } from '../../scope/setup/channels'
import { fixed, hertz } from '../plot/bode'
import { StepPlot } from '../plot/StepPlot'

const SETTLE_MS = 400

/** What would be played: the curve over time, its lines, and how long it takes. */
export function ExcitationPreview({
  drive,
  request,
  dark,
}: {
  drive: string
  /** Null while the settings are not complete. */
  request: SweepRequest | null
  dark: boolean
}) {
  const t = useT()
  const { found, problem } = useAnswer<ExcitationInfo>(
    request &&
      (() =>
        ask(
          api.POST('/api/v1/drives/{drive_id}/tune/excitation', {
            params: { path: { drive_id: drive } },
            body: request,
          }),
        )),
    SETTLE_MS,
    [JSON.stringify(request), drive],
  )
  const name = t('excite.one')
  const traces = useMemo(
    () =>
      found
        ? [
            {
              label: name,
              color: TRACE_COLORS[dark ? 'dark' : 'light'][0] ?? '',
              time: found.time_s,
              value: found.value,
            },
          ]
        : [],
    [found, dark, name],
  )
  if (problem) return <ProblemNote problem={problem} />
  if (!found) return <p className="dim">{t('loading')}</p>
  return (
    <div className="preview-plot">
      <StepPlot
        shared="excitation"
        traces={traces}
        unit={found.unit === '% of rated torque' ? t('step.torqueUnit') : found.unit}
        label={t('excite.title')}
        timeLabel={t('predict.time')}
        dark={dark}
        height={170}
      />
      <p className="dim">
        {t('excite.reported', {
          count: found.realisations,
          duration: fixed(found.duration_s, 1, 's'),
          lines: found.frequency_hz.length,
          from: hertz(found.frequency_hz[0]),
          to: hertz(found.frequency_hz.at(-1)),
          peak: figure(found.peak, 3),
          unit: found.unit === '% of rated torque' ? t('step.torqueUnit') : found.unit,
          crest: fixed(found.crest, 2),
        })}
      </p>
    </div>
  )
}
