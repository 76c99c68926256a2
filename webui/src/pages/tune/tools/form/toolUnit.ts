/** The unit of a field, where the tool states one apart from its label. */
export function unitOf(name: string, text: (name: string) => string): { unit?: string } {
  const key = `unit.${name}`
  const unit = text(key)
  return unit === key ? {} : { unit }
}
