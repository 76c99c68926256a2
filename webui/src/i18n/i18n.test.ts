import { readdirSync, readFileSync } from 'node:fs'
import { join } from 'node:path'
import ts from 'typescript'
import { describe, expect, it } from 'vitest'
import { catalogue } from './catalogue'
import { translate } from './index'

const SOURCE = new URL('..', import.meta.url).pathname
/** Written the same in both languages: names of things, not words. */
const SAME = new Set([
  'language.en',
  'language.zh',
  'connect.kind.can',
  'segment.doctorFactAlone',
  'help.ethercat.title',
  'help.can.title',
  'scope.csv',
])
/** Attributes that a person reads or hears. */
const SPOKEN = new Set([
  'label',
  'title',
  'placeholder',
  'aria-label',
  'description',
  'error',
  'alt',
  'help',
])
/** Text that is no language: the product's name, signs and units. */
const NEUTRAL = /^(servodeck|[^\p{L}]*|[AB]|B−A|ms|s|Hz|0x|rpm|\/s|1\/Δt)$/u

const entries = Object.entries(catalogue)

function sources(folder: string, wanted: RegExp): string[] {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) =>
    entry.isDirectory()
      ? sources(join(folder, entry.name), wanted)
      : wanted.test(entry.name)
        ? [join(folder, entry.name)]
        : [],
  )
}

/** Which keys a file can ask for: written in full, put together, by `known(t, prefix, …)`, or by
 * `under(prefix)`. */
function asked(code: string): { whole: Set<string>; made: RegExp[] } {
  const tree = ts.createSourceFile('x.tsx', code, ts.ScriptTarget.ES2022, true, ts.ScriptKind.TSX)
  const whole = new Set<string>()
  const made: RegExp[] = []
  const quoted = (text: string) => text.replace(/[.*+?^${}()|[\]\\]/g, '\\$&')
  const visit = (node: ts.Node) => {
    if (ts.isStringLiteralLike(node)) whole.add(node.text)
    if (ts.isTemplateExpression(node) && node.head.text.includes('.')) {
      const parts = [node.head.text, ...node.templateSpans.map((span) => span.literal.text)]
      made.push(new RegExp(`^${parts.map(quoted).join('.+')}$`, 'u'))
    }
    if (ts.isCallExpression(node) && node.expression.getText() === 'known') {
      const prefix = node.arguments[1]
      if (prefix && ts.isStringLiteral(prefix)) made.push(new RegExp(`^${quoted(prefix.text)}\\.`))
    }
    if (ts.isCallExpression(node) && node.expression.getText() === 'under') {
      const prefix = node.arguments[0]
      if (prefix && ts.isStringLiteral(prefix)) made.push(new RegExp(`^${quoted(prefix.text)}\\.`))
    }
    ts.forEachChild(node, visit)
  }
  visit(tree)
  return { whole, made }
}

function unused(codes: string[]): string[] {
  const found = codes.map(asked)
  const whole = new Set(found.flatMap((each) => [...each.whole]))
  const made = found.flatMap((each) => each.made)
  return Object.keys(catalogue).filter(
    (key) => !whole.has(key) && !made.some((pattern) => pattern.test(key)),
  )
}

/** Words in the markup that do not come from the catalogue. */
function bareStrings(file: string, code: string): string[] {
  const tree = ts.createSourceFile(file, code, ts.ScriptTarget.ES2022, true, ts.ScriptKind.TSX)
  const found: string[] = []
  const check = (text: string, node: ts.Node) => {
    if (
      text
        .trim()
        .split(/\s+/)
        .every((word) => NEUTRAL.test(word))
    )
      return
    const { line } = tree.getLineAndCharacterOfPosition(node.getStart())
    found.push(`${file}:${line + 1}: ${text.trim()}`)
  }
  const visit = (node: ts.Node) => {
    if (ts.isJsxText(node)) check(node.text, node)
    if (ts.isJsxAttribute(node) && SPOKEN.has(node.name.getText())) {
      const value = node.initializer
      if (value && ts.isStringLiteral(value)) check(value.text, node)
      if (
        value &&
        ts.isJsxExpression(value) &&
        value.expression &&
        ts.isStringLiteral(value.expression)
      ) {
        check(value.expression.text, node)
      }
    }
    if (ts.isJsxExpression(node) && node.expression && !ts.isJsxAttribute(node.parent)) {
      const strings = (part: ts.Node) => {
        if (ts.isStringLiteral(part) && /^[A-Z]\p{L}+ /u.test(part.text)) check(part.text, part)
        if (!ts.isCallExpression(part) && !ts.isJsxElement(part)) ts.forEachChild(part, strings)
      }
      strings(node.expression)
    }
    ts.forEachChild(node, visit)
  }
  visit(tree)
  return found
}

describe('the catalogue', () => {
  it('has both languages for every key', () => {
    for (const [key, texts] of entries) {
      expect(texts, key).toHaveLength(2)
      for (const text of texts) expect(text.trim(), key).not.toBe('')
    }
  })
  it('has the same variables in both languages', () => {
    const variables = (text: string) => (text.match(/\{\w+\}/g) ?? []).toSorted()
    for (const [key, [en, zh]] of entries) expect(variables(zh), key).toEqual(variables(en))
  })
  it('is translated: Chinese has Chinese signs, English has none', () => {
    for (const [key, [en, zh]] of entries) {
      if (SAME.has(key)) continue
      expect(/\p{Script=Han}/u.test(zh), `${key}: ${zh}`).toBe(true)
      expect(/\p{Script=Han}/u.test(en), `${key}: ${en}`).toBe(false)
    }
  })
  it('distinguishes one thing from several', () => {
    expect(translate('en', 'library.parameters', { count: 1 })).toBe('1 parameter')
    expect(translate('en', 'library.parameters', { count: 0 })).toBe('0 parameters')
    const counts = { sessions: 2, tokens: 1 }
    expect(translate('en', 'accounts.counts', counts)).toBe('2 log-ins, 1 token')
    expect(translate('zh', 'library.parameters', { count: 1 })).toBe('1 个参数')
  })
  it('fills variables in, and leaves unknown ones standing', () => {
    expect(translate('en', 'job.elapsed', { time: '3 s' })).toBe('3 s so far')
    expect(translate('zh', 'job.elapsed', {})).toContain('{time}')
  })
})

describe('the markup', () => {
  it('has no words of its own', () => {
    const found = sources(SOURCE, /\.tsx$/).flatMap((file) =>
      bareStrings(file, readFileSync(file, 'utf-8')),
    )
    expect(found).toEqual([])
    // Parses every page; a busy machine takes its time.
  }, 60_000)
  it('would be caught with one', () => {
    expect(bareStrings('x.tsx', '<p>Hello there</p>')).toHaveLength(1)
    expect(bareStrings('x.tsx', '<input placeholder="Name" />')).toHaveLength(1)
    expect(bareStrings('x.tsx', '<p>{ok ? "All good here" : ""}</p>')).toHaveLength(1)
    expect(bareStrings('x.tsx', '<p>{t("close")} · 3 ms</p>')).toEqual([])
  })
})

describe('the keys', () => {
  it('are all used', () => {
    // Not the catalogue's own files, the description of the interface, or tests.
    const files = sources(SOURCE, /\.tsx?$/).filter(
      (file) => !/\/texts\/|\.test\.ts$|\.d\.ts$/.test(file),
    )
    expect(unused(files.map((file) => readFileSync(file, 'utf-8')))).toEqual([])
  }, 60_000)
  it('would be missed', () => {
    const left = unused(["t('close')", 't(`page.${name}`)', "known(t, 'state', word)"])
    expect(left).toContain('cancel')
    expect(left).not.toContain('close')
    expect(left.some((key) => key.startsWith('page.') || key.startsWith('state.'))).toBe(false)
  })
})
