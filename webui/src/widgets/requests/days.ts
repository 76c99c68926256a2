/** Beginning of a day in the calendar of the person, `plus` days later, as the server takes it. */
export function dayStart(text: string, plus = 0): string {
  const date = new Date(`${text}T00:00:00`)
  date.setDate(date.getDate() + plus)
  return date.toISOString()
}
