import type { MessageInfo } from '../../api/schema'
import { useSay } from '../../i18n'

/** A message of the server in the page's language; its words where an older server sent no message. */
export function Said({
  message,
  words,
}: {
  message: MessageInfo | null | undefined
  words: string
}) {
  return useSay().message(message, words)
}
