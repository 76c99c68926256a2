import { Button } from '@mantine/core'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import { setState } from '../../live/store'
import { ProblemNote } from '../messages/ProblemNote'
import { useAction } from '../requests/useAction'

/** Resets the drive's faults; what it answers is shown as its new state. */
export function useFaultReset(drive: string) {
  const reset = useAction()
  const run = () =>
    reset.run(async () =>
      setState(
        await ask(
          api.POST('/api/v1/drives/{drive_id}/fault-reset', {
            params: { path: { drive_id: drive } },
          }),
        ),
      ),
    )
  return { ...reset, run }
}

export function FaultResetButton({
  reset,
  disabled = false,
}: {
  reset: ReturnType<typeof useFaultReset>
  disabled?: boolean
}) {
  const t = useT()
  return (
    <Button disabled={disabled} loading={reset.busy} onClick={() => void reset.run()}>
      {t('faults.reset')}
    </Button>
  )
}

/** What went wrong with it. */
export function FaultResetProblem({ reset }: { reset: ReturnType<typeof useFaultReset> }) {
  return <ProblemNote problem={reset.problem} onClose={reset.clear} />
}
