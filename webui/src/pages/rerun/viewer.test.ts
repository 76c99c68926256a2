// @vitest-environment happy-dom
import '../../testing/page'
import { readdirSync, readFileSync } from 'node:fs'
import { join } from 'node:path'
import { describe, expect, it } from 'vitest'
import { viewerUrl } from './viewer'

const SOURCES = join(import.meta.dirname, '..', '..')
const files = (folder: string): string[] =>
  readdirSync(folder, { withFileTypes: true }).flatMap((each) =>
    each.isDirectory() ? files(join(folder, each.name)) : [join(folder, each.name)],
  )

describe('addresses behind a path of a proxy', () => {
  it('have the path in front, also those of frames', () => {
    expect(viewerUrl('a b.sdrec', 'dark')).toBe('/station/rerun/?theme=dark&recording=a+b.sdrec')
  })

  it('are nowhere those of the root', () => {
    const named = /\.(ts|tsx|css)$/
    const absolute =
      /(?:src|href|action)=["'{`]+\/\w|fetch\(["'`]\/|url\(["']?\/\w|[`]\/(?:api\/v1|rerun|viser)\//
    const found = files(SOURCES)
      .filter((file) => named.test(file) && !/\.test\.|schema\.d/.test(file))
      .flatMap((file) =>
        readFileSync(file, 'utf8')
          .split('\n')
          // The client puts its root in front of the paths that it is given.
          .filter((line) => absolute.test(line) && !/ as '\/api\/v1|\bapi\.[A-Z]+\(/.test(line))
          .map((line) => `${file.slice(SOURCES.length)}: ${line.trim()}`),
      )
    expect(found).toEqual([])
  })
})
