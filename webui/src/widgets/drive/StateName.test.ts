import { createElement } from 'react'
import { renderToStaticMarkup } from 'react-dom/server'
import { describe, expect, it, vi } from 'vitest'
import { type Key, type Language, translate } from '../../i18n'
import { StateName } from './StateName'

let language: Language = 'en'
vi.mock('../../i18n', async (original) => ({
  ...(await original<typeof import('../../i18n')>()),
  useLanguage: () => language,
  useT: () => (key: Key) => translate(language, key),
}))

const shown = (to: Language, below?: boolean): string => {
  language = to
  return renderToStaticMarkup(createElement(StateName, { state: 'Switch on disabled', below }))
}

describe('the name of a state', () => {
  it('stands alone in English', () => {
    expect(shown('en')).toBe('Switch on disabled')
    expect(shown('en', true)).toBe('Switch on disabled')
  })
  it('stands in Chinese with the original as text, marked as English', () => {
    expect(shown('zh')).toBe('禁止接通<span lang="en">（Switch on disabled）</span>')
    expect(shown('zh', true)).toBe(
      '禁止接通<small class="original-below" lang="en">Switch on disabled</small>',
    )
  })
})
