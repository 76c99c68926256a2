import type { DiffRow, ParameterRow } from '../../api/schema'
import { useT } from '../../i18n'
import { ValueTable } from '../../widgets/parameters/ValueTable'

const canTick = (row: DiffRow) => row.status === 'differs' && row.file_raw !== null

/** Row by row: what the file (or the other side) says, what the drive says, the default. */
export function DiffTable(props: {
  rows: DiffRow[]
  ticked: ReadonlySet<string>
  onTick: (keys: ReadonlySet<string>) => void
  parameters: ParameterRow[]
}) {
  const t = useT()
  return (
    <ValueTable
      {...props}
      sides={[
        { heading: t('compare.theirs'), of: (row) => [row.file_value, row.file_raw] },
        { heading: t('compare.drive'), of: (row) => [row.drive_value, row.drive_raw] },
        {
          heading: t('column.default'),
          className: 'wide-only dim',
          of: (row) => [row.default_value, row.default_raw],
        },
      ]}
      canTick={canTick}
      tickAll
      mark={(row) => [MARKS[row.status], t(`diff.${row.status}`)]}
      rowClass={(row) => `diff-${row.status}`}
    />
  )
}

const MARKS: Record<DiffRow['status'], string> = {
  differs: 'differs',
  same: 'quiet',
  not_in_drive: 'refused',
  not_in_file: 'quiet',
  invalid: 'refused',
  read_only: 'quiet',
  energises: 'refused',
}
