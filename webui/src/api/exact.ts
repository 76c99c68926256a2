/** Whole numbers of a drive: of its rows, of comparisons, and of changes that can be undone. */
const WHOLE =
  /("(?:(?:default|drive|file|base|ours|theirs|controller)_)?(?:raw|value)"|"[0-9A-F]{4}:[0-9A-F]{2}")(\s*:\s*)(-?\d{16,20})(?=\s*[,}\]])/g

/**
 * JSON in which those that a number of this language does not hold exactly (64 bits, beyond 2^53)
 * are texts of their digits. The server takes them back as such.
 */
export const exactJson = (text: string): string =>
  text.replace(WHOLE, (all, name: string, colon: string, digits: string) =>
    Number.isSafeInteger(Number(digits)) ? all : `${name}${colon}"${digits}"`,
  )
