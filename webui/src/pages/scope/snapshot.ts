import { API_ROOT, ProblemError } from '../../api/client'
import type { Problem, ScopeSetup, SnapshotHeader, SnapshotTrace } from '../../api/schema'
import type { Samples } from '../../live/worker-messages'

const MAGIC = 'SDSNAP1\n'

/** A snapshot as a file (layout: backend/scope/stored.py). */
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

const address = (name: string) => `${API_ROOT}/api/v1/scope/snapshots/${encodeURIComponent(name)}`

/** The file's bytes do not fit the generated client, which speaks JSON. */
export async function storeSnapshot(name: string, file: Blob): Promise<void> {
  const answer = await fetch(address(name), { method: 'POST', body: file })
  if (!answer.ok) throw new ProblemError((await answer.json()) as Problem)
}

export async function loadSnapshot(name: string): ReturnType<typeof unpackAsync> {
  const answer = await fetch(address(name))
  if (!answer.ok) throw new ProblemError((await answer.json()) as Problem)
  return unpackAsync(answer)
}

const unpackAsync = async (answer: Response) => unpackSnapshot(await answer.arrayBuffer())
