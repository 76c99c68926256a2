import { api, ask } from '../../../api/client'
import type { GainValues, PredictionInfo } from '../../../api/schema'
import { useAnswer } from '../../../widgets/requests/useAnswer'
import type { NotchShape } from '../results'

const SETTLE_MS = 300

/** The speed loop that notches and gains would make of a stored response of the mechanics. */
export function usePrediction(
  drive: string,
  file: string | null,
  notches: (NotchShape | null)[],
  gains: GainValues | null,
) {
  return useAnswer<PredictionInfo>(
    file !== null && gains !== null
      ? () =>
          ask(
            api.POST('/api/v1/drives/{drive_id}/tune/predict', {
              params: { path: { drive_id: drive } },
              body: { measurement: file, notches: notches.filter((each) => each !== null), gains },
            }),
          )
      : null,
    SETTLE_MS,
    [JSON.stringify([drive, file, notches, gains])],
    'forget',
  )
}
