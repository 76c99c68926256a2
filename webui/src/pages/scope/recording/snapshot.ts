import { api, ask } from '../../../api/client'
import type { ScopeSetup, SnapshotHeader, SnapshotTrace } from '../../../api/schema'
import type { Samples } from '../../../live/worker/worker-messages'

const MAGIC = 'SDSNAP1\n'

/** A snapshot as a file (layout: backend/axes/scope/stored.py). */
export function packSnapshot(
  head: { notes: string; origin_s: number; setup: ScopeSetup; created: string },
  traces: Omit<SnapshotTrace, 'rows'>[],
  samples: Samples[],
): Blob {
  const header: SnapshotHeader = {
    ...head,
    traces: traces.map((trace, i) => ({ ...trace, rows: samples[i]?.times.length ?? 0 })),
  }
  const text = new TextEncoder().encode(JSON.stringify(header))
  const length = new DataView(new ArrayBuffer(4))
  length.setUint32(0, text.length, true)
  // Browsers run on little-endian machines, as the format is.
  const columns = samples.flatMap(({ times, values }) => [times.slice(), values.slice()])
  return new Blob([MAGIC, length.buffer, text, ...columns])
}

/** The traces of a snapshot's file. */
function unpackSnapshot(data: ArrayBuffer): { header: SnapshotHeader; samples: Samples[] } {
  const view = new DataView(data)
  const length = view.getUint32(MAGIC.length, true)
  const begin = MAGIC.length + 4
  const text = new TextDecoder().decode(new Uint8Array(data, begin, length))
  const header = JSON.parse(text) as SnapshotHeader
  let at = begin + length
  const column = (rows: number) => {
    const found = new Float64Array(rows)
    for (let i = 0; i < rows; i++) found[i] = view.getFloat64(at + 8 * i, true)
    at += 8 * rows
    return found
  }
  const samples = header.traces.map(({ rows }) => ({ times: column(rows), values: column(rows) }))
  return { header, samples }
}

const raw = { 'Content-Type': 'application/octet-stream' }

/** The file's bytes as they are, through the client that every other request goes through. */
export async function storeSnapshot(name: string, file: Blob): Promise<void> {
  await ask(
    api.POST('/api/v1/scope/snapshots/{name}', {
      params: { path: { name } },
      body: file as never,
      bodySerializer: (body: unknown) => body as BodyInit,
      headers: raw,
    }),
  )
}

export async function loadSnapshot(
  name: string,
): Promise<{ header: SnapshotHeader; samples: Samples[] }> {
  const data = await ask(
    api.GET('/api/v1/scope/snapshots/{name}', {
      params: { path: { name } },
      parseAs: 'arrayBuffer',
    }),
  )
  return unpackSnapshot(data)
}
