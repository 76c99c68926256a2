import { ActionIcon, Button, NativeSelect } from '@mantine/core'
import type { DriveSummary, SegmentAxis } from '../../../api/schema'
import { useT } from '../../../i18n'
import { useDrives } from '../../../live/store'
import { Icon } from '../../../widgets/layout/Icon'
import { useSets } from '../sets/sets'

/** The drives of one list in the order of the cable, each with its parameter set. */
export function SegmentAxes({
  axes,
  onChange,
}: {
  axes: SegmentAxis[]
  onChange: (axes: SegmentAxis[]) => void
}) {
  const t = useT()
  const drives = useDrives() ?? []
  const { sets } = useSets()
  const free = drives.filter((drive) => !axes.some((axis) => axis.drive_id === drive.id))
  const setsOf = (drive: DriveSummary | undefined) =>
    sets.filter((each) => each.profile === drive?.profile).map((each) => each.file)
  const add = (drive: DriveSummary) =>
    onChange([
      ...axes,
      { drive_id: drive.id, set_file: newestOf(drive, sets) ?? setsOf(drive)[0] ?? '' },
    ])
  const next = free.find((drive) => setsOf(drive).length > 0)
  return (
    <fieldset className="segment-axes">
      <legend>{t('handover.segment')}</legend>
      <ol>
        {axes.map((axis, place) => {
          const drive = drives.find((each) => each.id === axis.drive_id)
          const name = drive?.name ?? axis.drive_id
          const at = (changed: SegmentAxis) =>
            onChange(axes.map((each, other) => (other === place ? changed : each)))
          return (
            <li key={axis.drive_id} className="segment-axis">
              <NativeSelect
                label={t('three.axis')}
                value={axis.drive_id}
                onChange={(event) => {
                  const chosen = drives.find((each) => each.id === event.currentTarget.value)
                  if (!chosen) return
                  const kept = setsOf(chosen).includes(axis.set_file)
                  at({
                    drive_id: chosen.id,
                    set_file: kept ? axis.set_file : (setsOf(chosen)[0] ?? ''),
                  })
                }}
                data={[...(drive ? [drive] : []), ...free].map((each) => ({
                  value: each.id,
                  label: each.name,
                }))}
              />
              <NativeSelect
                label={t('handover.segmentSet')}
                value={axis.set_file}
                onChange={(event) => at({ ...axis, set_file: event.currentTarget.value })}
                data={[...new Set([axis.set_file, ...setsOf(drive)])]}
              />
              <ActionIcon
                disabled={place === 0}
                aria-label={t('handover.segmentUp', { name })}
                onClick={() => onChange(swapped(axes, place))}
              >
                <span aria-hidden="true">↑</span>
              </ActionIcon>
              <ActionIcon
                disabled={axes.length === 1}
                aria-label={t('handover.segmentRemove', { name })}
                onClick={() => onChange(axes.filter((each) => each !== axis))}
              >
                <Icon name="cross" />
              </ActionIcon>
            </li>
          )
        })}
      </ol>
      {next && <Button onClick={() => add(next)}>{t('handover.segmentAdd')}</Button>}
    </fieldset>
  )
}

/** The newest set that was saved from this very drive. */
function newestOf(
  drive: DriveSummary,
  sets: readonly { file: string; profile: string; drive_name: string }[],
): string | undefined {
  return sets.find((each) => each.profile === drive.profile && each.drive_name === drive.name)?.file
}

function swapped(axes: SegmentAxis[], place: number): SegmentAxis[] {
  const [before, moved] = [axes[place - 1], axes[place]]
  if (!before || !moved) return axes
  return axes.map((each, at) => (at === place ? before : at === place - 1 ? moved : each))
}
