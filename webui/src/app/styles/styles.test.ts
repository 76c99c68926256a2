import { readdirSync, readFileSync } from 'node:fs'
import { join } from 'node:path'
import { expect, it } from 'vitest'

const SOURCE = new URL('../..', import.meta.url).pathname

function sheets(folder: string): string[] {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) =>
    entry.isDirectory()
      ? sheets(join(folder, entry.name))
      : entry.name.endsWith('.css')
        ? [join(folder, entry.name)]
        : [],
  )
}

/** The selectors of a style sheet, each once. */
function selectors(css: string): Set<string> {
  const bare = css.replace(/\/\*[^]*?\*\//g, '')
  const found = [...bare.matchAll(/([^{}]+)\{/g)].flatMap(([, list]) => (list ?? '').split(','))
  return new Set(found.map((each) => each.trim()).filter((each) => /^[.#\w]/.test(each)))
}

it('styles nothing in two sheets: pages come one by one, and the last to come would win', () => {
  const first = new Map<string, string>()
  const twice: string[] = []
  for (const file of sheets(SOURCE)) {
    for (const selector of selectors(readFileSync(file, 'utf-8'))) {
      const other = first.get(selector)
      if (other) twice.push(`${selector}: ${other} and ${file}`)
      else first.set(selector, file)
    }
  }
  expect(first.size).toBeGreaterThan(100)
  expect(twice).toEqual([])
})
