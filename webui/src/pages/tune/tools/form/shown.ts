/** A text of a tool by its name, with places filled in. */
export type Text = (name: string, values?: Record<string, string>) => string

/** Ends of a confidence interval; null is an end that is not known. */
export type Ends = [number | null, number | null] | null

/** A verdict or finding as a person reads it. */
export interface ShownNote {
  words: string
  tone: 'good' | 'warn' | 'fault' | 'info'
}

/** A figure with its interval; a value of null cannot be known. */
export interface ShownRow {
  name: string
  value: number | null
  unit: string
  ends?: Ends
}

/** The row of an estimate, with its text by name; null is what cannot be known. */
export const figureRow = (
  text: Text,
  name: string,
  found: { value: number; ci95: NonNullable<Ends> } | null,
  unit: string,
): ShownRow => ({
  name: text(name),
  value: found?.value ?? null,
  unit,
  ends: found?.ci95 ?? null,
})

/** A table whose cells are texts. */
export interface ShownTable {
  name: string
  head: string[]
  rows: string[][]
}
