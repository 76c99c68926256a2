type Send = (drive: string, keys: string[]) => Promise<void>

/**
 * One request for all keys of a drive that are asked for in the same turn: a page of a dozen
 * forms would otherwise ask for more jobs at a time than the server takes.
 */
export function together(send: Send): Send {
  const waiting = new Map<string, { keys: Set<string>; sent: Promise<void> }>()
  return (drive, keys) => {
    if (keys.length === 0) return Promise.resolve()
    const before = waiting.get(drive)
    if (before) {
      for (const key of keys) before.keys.add(key)
      return before.sent
    }
    const all = new Set(keys)
    const sent = Promise.resolve().then(() => {
      waiting.delete(drive)
      return send(drive, [...all])
    })
    waiting.set(drive, { keys: all, sent })
    return sent
  }
}
