import type { Texts } from '../types'

/** What the server says of recordings of other programs. As in said.ts, the English is its own. */
export const saidOfImports = {
  'said.iNotPeriodic': [
    'the excitation does not repeat itself: what friction and backlash distort is told from noise in part only; record at least four periods of a multisine for more',
    '激励不重复：摩擦和间隙引起的失真只能部分地与噪声区分；如需更多信息，请记录至少四个周期的多正弦',
  ],
  'said.iFewPeriods': [
    'only {count} settled periods: the noise is known roughly; record four or more',
    '仅有 {count} 个稳定周期：噪声仅粗略可知；请记录四个或更多周期',
  ],
  'said.iClipped': [
    'the input stands at its highest or lowest value for {share} of the time: it is limited, or a sequence of two levels',
    '输入在 {share} 的时间内处于最高或最低值：它被限幅，或为两电平序列',
  ],
  'said.iNoRigid': [
    'no inertia: the lowest frequencies do not show how friction and inertia share the torque; excite lower frequencies',
    '未得出惯量：最低频率未显示摩擦与惯量如何分担转矩；请激励更低的频率',
  ],
  'said.iNoModel': [
    'no model explains the response: no modes are told',
    '没有模型能解释该响应：未给出模态',
  ],
  'said.iRefuted': [
    "the phase is {deg}° at {hz} Hz; from a torque to the speed of the same shaft it stays within ±90°. The output is filtered, late, or another shaft's: no inertia, notch or gain is concluded.{filtered}",
    '{hz} Hz 处相位为 {deg}°；从转矩到同一轴的速度，相位应在 ±90° 之内。输出经过滤波、滞后，或属于另一根轴：不得出惯量、陷波或增益。{filtered}',
  ],
  'said.iIncoherent': [
    'check which columns are input and output, or excite more strongly',
    '请检查哪些列是输入和输出，或加大激励',
  ],
  'said.iRowsTry': [
    'export it again without gaps, or cut the file before that line',
    '请重新导出且不留空缺，或在该行之前截断文件',
  ],
  'said.iColumnTry': ["give a column's name or number", '请给出列名或列号'],
  'said.iTwoColumns': ['give two columns', '请给出两列'],
  'said.iMoreData': [
    'record a multisine, a chirp or noise, or widen the band that is evaluated',
    '请记录多正弦、扫频或噪声，或放宽所计算的频段',
  ],
  'said.iExportText': [
    'export at least two columns of numbers, separated by comma, semicolon or tab',
    '请导出至少两列数字，以逗号、分号或制表符分隔',
  ],
  'said.iBinaryTry': [
    'export the recording as CSV or as MATLAB MAT (version 7 or older)',
    '请将记录导出为 CSV 或 MATLAB MAT（版本 7 或更早）',
  ],
  'said.iShorter': ['export a shorter part, or fewer columns', '请导出较短的部分或更少的列'],
  'said.iUnitTry': [
    'give the unit of the time column: s, ms, us or ns',
    '请给出时间列的单位：s、ms、us 或 ns',
  ],
} as const satisfies Texts
