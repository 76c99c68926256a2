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
  it('is told sentence by sentence, as a verdict or a refused tuning has several', () => {
    expect(
      said(
        zh,
        'Axis 1: no candidate kept its promise when it was verified: ' +
          '83 Hz: sensitivity 2.10 instead of 1.80; phase margin 31° instead of 45°; ' +
          'the time for one tuning was used up',
      ),
    ).toBe(
      'Axis 1: 验证时没有方案达到预期：' +
        '83 Hz: 灵敏度 2.10，应为 1.80；相位裕度 31°，应为 45°；单次整定的时间已用完',
    )
    expect(
      said(
        zh,
        'the torque was at its limit: raise the limit or lower the acceleration\n' +
          'the moves do not follow inertia and friction (R² below 0.8)',
      ),
    ).toBe('转矩达到限值：请提高限值或降低加速度\n运动不符合惯量与摩擦模型（R² 低于 0.8）')
  })
  it('is told whole where a sentence has a colon or a semicolon of its own', () => {
    expect(
      said(zh, 'coherence is low: raise the excitation, or look for backlash and friction'),
    ).toBe('相干性偏低：请增大激励，或检查间隙和摩擦')
    expect(said(zh, 'torque 81 is beyond the limit of 80: the axis is braked and disabled')).toBe(
      'torque 81 超出限值 80：轴已制动并断开使能',
    )
  })
  it('is told as it came in English, and where nobody translated it', () => {
    for (const text of ['3 of 6: frequency response', 'Read the dictionary of can0 5', 'x: y: z'])
      expect(said(en, text)).toBe(text)
    expect(said(zh, 'something new')).toBe('something new')
  })
})
