import type { ParameterRow, ThreeWayRow } from '../../../api/schema'
import { useT } from '../../../i18n'
import { ValueTable } from '../../../widgets/parameters/ValueTable'

/** Rows whose value in the set differs from the drive's can be written there. */
const canTick = (row: ThreeWayRow) =>
  row.status === 'theirs' || row.status === 'drive' || row.status === 'conflict'

/** Row by row: base, set and drive, and who changed what. */
export function ThreeWayTable(props: {
  rows: ThreeWayRow[]
  ticked: ReadonlySet<string>
  onTick: (keys: ReadonlySet<string>) => void
  parameters: ParameterRow[]
}) {
  const t = useT()
  return (
    <ValueTable
      {...props}
      className="three-way"
      sides={[
        { heading: t('three.column.base'), of: (row) => [row.base_value, row.base_raw] },
        { heading: t('three.column.theirs'), of: (row) => [row.theirs_value, row.theirs_raw] },
        { heading: t('compare.drive'), of: (row) => [row.drive_value, row.drive_raw] },
      ]}
      canTick={canTick}
      mark={(row) => [MARKS[row.status], t(`three.status.${row.status}`)]}
    />
  )
}

const MARKS: Record<ThreeWayRow['status'], string> = {
  same: 'quiet',
  both: 'quiet',
  theirs: 'differs',
  drive: 'edited',
  conflict: 'refused',
  not_in_theirs: 'quiet',
  not_in_drive: 'refused',
  invalid: 'refused',
  read_only: 'quiet',
  energises: 'refused',
}
