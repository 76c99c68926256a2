import type { ScopeSetup } from '../../../api/schema'
import { useDrives } from '../../../live/store'
import { type Infos, infoOf, mathProblem, scaleOf, type Shown } from './setup'

/** The traces of a set-up as they are shown: those of drives that are here, then computed ones. */
export function useShown(setup: ScopeSetup, infos: Infos): Shown[] {
  const drives = useDrives()
  const channels = setup.traces.flatMap((trace): Shown[] => {
    const owner = drives?.find((drive) => drive.id === trace.drive)
    if (!owner) return []
    const info = infoOf(infos, trace.drive, trace.key)
    return [
      {
        id: trace.id,
        label: `${owner.name} ${info?.name ?? trace.key}`,
        unit: scaleOf(trace, info).unit,
        synchronous: info?.synchronous ?? null,
        computed: false,
      },
    ]
  })
  const computed = setup.maths
    .filter((math) => mathProblem(math) === null)
    .map(({ id, name, unit, expression }) => ({
      id,
      label: name || expression,
      unit,
      synchronous: null,
      computed: true,
    }))
  return [...channels, ...computed]
}
