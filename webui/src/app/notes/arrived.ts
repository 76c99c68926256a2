import { contents, subscribe } from '../../live/store'

/** A fetch may fail before the page has word that the connection is gone. */
const AGAIN_MS = 1000
const TRIES = 3

/**
 * What `load` fetches. Without a connection it waits for one and fetches again: a page that was
 * asked for on bad Wi-Fi comes by itself. Throws what the last try threw where there is a
 * connection and still nothing comes, as after an update of the server.
 */
export async function arrived<T>(load: () => Promise<T>): Promise<T> {
  let failures = 0
  for (;;) {
    try {
      return await load()
    } catch (error) {
      if (contents.link.open && ++failures >= TRIES) throw error
    }
    await new Promise((done) => setTimeout(done, AGAIN_MS))
    if (await connected()) failures = 0
  }
}

/** Resolves when there is a connection: true where it had to be waited for. */
function connected(): Promise<boolean> {
  if (contents.link.open) return Promise.resolve(false)
  return new Promise((done) => {
    const end = subscribe('link', () => {
      if (!contents.link.open) return
      end()
      done(true)
    })
  })
}
