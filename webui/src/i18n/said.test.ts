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
    expect(said(zh, '2 of 6: inertia and friction: going back and evaluating')).toBe(
      '第 2 步（共 6 步）：惯量与摩擦：正在返回并计算',
    )
  })
  it('is told sentence by sentence, as a verdict or a refused tuning has several', () => {
    expect(
      said(
        zh,
        'Axis 1: no design met its prediction in the verification: ' +
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
  it('is told part by part where a loop contradicts its prediction', () => {
    expect(
      said(
        zh,
        'the tuned loop answered otherwise than the axis as it was measured before lets expect, as with play (gear, coupling, key) or a resonance too narrow for the lines: -3 dB point at 110 Hz where 128 Hz was predicted; phase margin of 59° where 52° was predicted; designed again for the axis both as it was measured and as its loop shows it, with 87% of the speed gain; verified with other realisations at 113 Hz, predicted from the loop at 115 Hz',
      ),
    ).toBe(
      '整定后回路的响应与此前测得的轴特性所预期的不同，可能因间隙（齿轮、联轴器、键）或谐振窄于谱线间隔：−3 dB 点在 110 Hz，预测为 128 Hz；相位裕度 59°，预测为 52°；已针对测得的和回路中显示的轴特性重新设计，速度增益为原方案的 87%；以其他激励验证为 113 Hz，根据回路预测为 115 Hz',
    )
  })
  it('is told whole where a sentence has a colon or a semicolon of its own', () => {
    expect(
      said(zh, 'coherence is low: raise the excitation, or look for backlash and friction'),
    ).toBe('相干性偏低：请增大激励，或检查间隙和摩擦')
    expect(said(zh, 'torque 81 is beyond the limit of 80: the axis is braked and disabled')).toBe(
      'torque 81 超出限值 80：轴已制动并断使能',
    )
  })
  it('is told as it came in English, and where nobody translated it', () => {
    for (const text of ['3 of 6: frequency response', 'Read the dictionary of can0 5', 'x: y: z'])
      expect(said(en, text)).toBe(text)
    expect(said(zh, 'something new')).toBe('something new')
  })
})
