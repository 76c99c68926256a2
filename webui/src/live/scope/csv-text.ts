/**
 * Text as a cell of a CSV file, in quotes. With an apostrophe in front where a spreadsheet would
 * take it for a formula, as in `backend/foundation/store/spreadsheet.py`.
 */
export function csvText(text: string): string {
  const risky = /^[ \u00a0]*[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20]/.test(text)
  return `"${risky ? "'" : ''}${text.replaceAll('"', '""')}"`
}
