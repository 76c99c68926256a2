import type { ParameterRow } from '../../api/schema'

/** A parameter in the page's language; `original` holds the English row where that differs. */
export interface ShownRow extends ParameterRow {
  original?: ParameterRow
}

/** English text of a profile to its translation. */
type Known = ReadonlyMap<string, string>
/** Rows and texts are replaced as a whole, and every reader needs the same translated rows. */
const made = new WeakMap<ParameterRow[], { texts: Known; rows: ShownRow[] }>()

export function translatedRows(rows: ParameterRow[], texts: Known): ShownRow[] {
  const before = made.get(rows)
  if (before?.texts === texts) return before.rows
  const now = rows.map((row) => translated(row, texts))
  made.set(rows, { texts, rows: now })
  return now
}

function translated(row: ParameterRow, texts: Known): ShownRow {
  const say = (text: string) => texts.get(text) ?? text
  const all = (labels: Record<string, string>) =>
    Object.fromEntries(Object.entries(labels).map(([value, label]) => [value, say(label)]))
  return {
    ...row,
    name: say(row.name),
    help: say(row.help),
    group: say(row.group),
    notes: say(row.notes),
    also_printed: row.also_printed.map(say),
    enum: all(row.enum),
    bits: all(row.bits),
    original: row,
  }
}
