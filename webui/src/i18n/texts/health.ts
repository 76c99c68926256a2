import type { Texts } from '../types'

/** Tune page: baseline, comparison and trend of an axis. */
export const health = {
  'health.measure': ['Measure a baseline, or otherwise', '测量基线或自定设置'],
  'health.repeat': ['Repeat the measurements', '重复测量'],
  'health.baseline': [
    'Baseline of {rounds} rounds, signed {when} by {person}',
    '由 {rounds} 轮构成的基线，{person} 于 {when} 签署',
  ],
  'health.limits': [
    'Within the limits of the baseline: {travel} rev, {speed} rpm, {torque} % of rated torque',
    '采用基线的限值：{travel} rev、{speed} rpm、额定转矩的 {torque} %',
  ],
  'health.notIntact': [
    'The baseline is not what was signed: its checksum differs. Nothing is compared with it; sign a new one.',
    '基线与签署时不同：校验和不一致。不与其比较；请签署新的基线。',
  ],
  'health.otherSettings': [
    '{count} rounds since the baseline were measured with other settings and are not compared.',
    '基线之后有 {count} 轮采用其他设置测量，未参与比较。',
  ],
  'health.tooFew': [
    'A baseline is signed from a check of {count} rounds or more.',
    '基线由 {count} 轮或更多轮的检查签署。',
  ],
  'health.person': ['Signed by', '签署人'],
  'health.notes': ['Notes on the baseline', '基线备注'],
  'health.sign': ['Sign {count} rounds as the baseline', '将 {count} 轮签署为基线'],
  'health.trend': ['Trend', '趋势'],
  'health.over': ['{name} over time', '{name}随时间变化'],
  'health.date': ['Date', '日期'],
  'health.resonance': ['Resonance', '谐振'],
  'health.antiresonance': ['Antiresonance', '反谐振'],
  'health.friction': ['Friction', '摩擦'],
  'health.inertia': ['Inertia', '惯量'],
  'health.step_rise': ['Rise time of the step', '阶跃上升时间'],
  'health.step_overshoot': ['Overshoot of the step', '阶跃超调'],
} satisfies Texts
