import { describe, expect, it } from 'vitest'

/** All of the page's own code. */
const files: Record<string, string> = import.meta.glob(['../**/*.ts', '../**/*.tsx'], {
  query: '?raw',
  import: 'default',
  eager: true,
})

/** Fields in which the server sends sentences. */
const SENTENCE = String.raw`(?:detail|remedy|problem|message|verdict|step|note|text|why|reason|warnings?|notes|tried|failed(?:\[\w+\])?)`
const READS = [
  // `job.step.includes('…')`, `row.problem.startsWith('…')`, `each.text.match(…)`
  new RegExp(
    String.raw`\.${SENTENCE}\??\.(?:includes|startsWith|endsWith|match|matchAll|search|indexOf)\(`,
    'g',
  ),
  // `/…/.test(problem.detail)`, `pattern.exec(job.step)`
  new RegExp(String.raw`\.(?:test|exec)\(\w+(?:\??\.\w+)*\.${SENTENCE}\)`, 'g'),
  // `entry.text === 'STOP'`; a token of an expression is the page's own
  /\b(?!token\b)\w+\??\.(?:detail|remedy|message|text|why)\s*[!=]==\s*'[^']+'/g,
]

function reads(source: string): string[] {
  return READS.flatMap((pattern) => Array.from(source.matchAll(pattern), ([found]) => found))
}

describe('sentences of the server', () => {
  it('decide nothing on the page', () => {
    const found = Object.entries(files)
      .filter(([path]) => !path.endsWith('.test.ts') && !path.endsWith('.test.tsx'))
      .flatMap(([path, source]) => reads(source).map((each) => `${path}: ${each}`))
    expect(found).toEqual([])
  })
  it('would be found', () => {
    expect(reads(`if (job.step.includes('of 6')) x()`)).toHaveLength(1)
    expect(reads(`/^STOP/.exec(entry.text)`)).toHaveLength(1)
    expect(reads(`last?.text !== 'STOP'`)).toHaveLength(1)
  })
})
