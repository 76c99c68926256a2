import type { ParameterRow } from '../../api/schema'

type Named = Pick<ParameterRow, 'key' | 'name' | 'number'>

/** A maker's number such as P08.02 or PA_38, an object such as 2042:03, 608Fh or 608F:01h. */
const NUMBER = /\b(?:[A-Z]{1,2}_?\d{1,3}(?:\.\d{2})?|[0-9A-F]{4}(?::[0-9A-F]{2}h?|h))\b/g

/** The text in pieces, each with the parameter that it names or null. Joined it is the text. */
export function namedParameters<Row extends Named>(
  text: string,
  rows: readonly Row[],
): { text: string; row: Row | null }[] {
  const parts: { text: string; row: Row | null }[] = []
  let end = 0
  for (const match of text.matchAll(NUMBER)) {
    const row = rowOf(match[0], rows)
    if (row === null) continue
    if (match.index > end) parts.push({ text: text.slice(end, match.index), row: null })
    parts.push({ text: match[0], row })
    end = match.index + match[0].length
  }
  if (end < text.length || parts.length === 0) parts.push({ text: text.slice(end), row: null })
  return parts
}

function rowOf<Row extends Named>(number: string, rows: readonly Row[]): Row | null {
  const bare = number.replace(/h$/, '')
  return (
    rows.find((row) => row.number === number || row.key === bare) ??
    rows.find((row) => bare.length === 4 && row.key.startsWith(`${bare}:`)) ??
    null
  )
}
