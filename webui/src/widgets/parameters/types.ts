import type { ParameterRow } from '../../api/schema'

export type Raw = number | string
/** Description part of a row. */
export type ParameterInfo = Omit<ParameterRow, 'reading'>
