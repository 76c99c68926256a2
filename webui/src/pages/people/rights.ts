import type { Right } from '../../api/schema'
import type { Key, T } from '../../i18n'

/** What an invitation may allow beyond looking. */
export const GRANTABLE: Right[] = ['parameters', 'measure', 'motion']

export const rightsInWords = (t: T, rights: Right[]) =>
  rights.map((each) => t(`right.${each}` as Key)).join(', ')
