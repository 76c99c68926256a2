import { describe, expect, it } from 'vitest'
import { type T, translate } from './index'
import { said } from './said'

const zh: T = (key, variables) => translate('zh', key, variables)
const en: T = (key, variables) => translate('en', key, variables)

describe('what the server says of a job', () => {
  it('is told in Chinese, with what the server put in', () => {
    expect(said(zh, 'asking address 104')).toBe('正在询问地址 104')
    expect(said(zh, 'Read X anew')).toBe('重新读取 X')
    expect(said(zh, 'Home X (method 35)')).toBe('X 回零（方式 35）')
  })
  it('is told part by part, and what is a name stays', () => {
    expect(said(zh, 'Frequency response: Spindle')).toBe('频率响应：Spindle')
    expect(said(zh, '2 of 6: inertia and friction: evaluating')).toBe(
      '第 2 步（共 6 步）：惯量与摩擦：正在计算',
    )
  })
  it('is told as it came in English, and where nobody translated it', () => {
    for (const text of ['3 of 6: frequency response', 'Read the dictionary of can0 5', 'x: y: z'])
      expect(said(en, text)).toBe(text)
    expect(said(zh, 'something new')).toBe('something new')
  })
})
