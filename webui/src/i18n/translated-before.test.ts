import { beforeAll, describe, expect, it } from 'vitest'
import { load, words } from './message'
import { translatedBefore } from './translated-before'

beforeAll(async () => {
  await load('en')
  await load('zh')
})

describe('sentences that the page showed in Chinese by their words', () => {
  it.each(translatedBefore)('%s is in the catalogue in both languages', (code, english) => {
    const message = { code, params: {} }
    const shown = words('en', message, '')
    for (const fragment of english.split('{}')) expect(shown).toContain(fragment)
    expect(words('zh', message, '')).toMatch(/\p{Script=Han}/u)
  })
})
