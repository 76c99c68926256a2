import { useOriginalRows } from '../../live/store'
import { type ShownRow, translatedRows } from './shown-row'
import { useTexts } from './texts'

/** The parameters of a drive with names, help, groups and values in the page's language. */
export function useRows(drive: string): ShownRow[] | null {
  const rows = useOriginalRows(drive)
  const texts = useTexts(drive)
  return rows === null || texts === null ? rows : translatedRows(rows, texts)
}
