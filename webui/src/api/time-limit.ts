/** Longer than any answer takes: what takes longer is a job. A file may come over a slow line. */
const ANSWER_MS = 60_000
const FILE_MS = 900_000

/**
 * A request that ends: a network that swallows everything would keep a button turning for a
 * quarter of an hour, until the browser gives up.
 */
export function withTimeLimit(request: Request, send: typeof fetch = fetch): Promise<Response> {
  const file = request.headers.get('Content-Type') === 'application/octet-stream'
  return send(request, { signal: AbortSignal.timeout(file ? FILE_MS : ANSWER_MS) })
}
