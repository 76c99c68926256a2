import type { Texts } from '../../types'

/** Scales of position, speed and acceleration: origins, and how a person teaches them. */
export const scales = {
  'scales.title': ['Scales', '标度'],
  'scales.help': [
    'The meaning of a raw value of this drive, and its source. While the scale of position or speed is not certain, no tool moves the axis in units.',
    '该驱动器的原始值代表什么，以及其来源。位置或速度的标度未确定时，任何工具都不会按单位移动该轴。',
  ],
  'scales.certain': ['Position and speed are certain.', '位置和速度的标度已确定。'],
  'scales.uncertain': [
    'The axis cannot be moved in units. Teach or state the scale below.',
    '无法按单位移动该轴。请在下方示教或给定标度。',
  ],
  'scales.quantity.position': ['Position', '位置'],
  'scales.quantity.velocity': ['Speed', '速度'],
  'scales.quantity.acceleration': ['Ramps', '加减速'],
  'scales.per': ['{value} raw per {unit}', '每 {unit} 对应 {value} 个原始值'],
  'scales.time': ['ramps are times in ms', '加减速以毫秒时间表示'],
  'scales.origin.manual': ['manual', '手册'],
  'scales.origin.makers_file': ["maker's file", '厂家文件'],
  'scales.origin.drive': ['read from the drive', '从驱动器读取'],
  'scales.origin.user': ['stated by a person', '由人员给定'],
  'scales.origin.measured': ['measured', '测量得出'],
  'scales.origin.unknown': ['unknown', '未知'],
  'scales.uncertainty.no_resolution': [
    'Increments per revolution are unknown.',
    '每转增量数未知。',
  ],
  'scales.uncertainty.feed_of_one': [
    '6092h states one unit per revolution although 608Fh states an encoder resolution: 6092h was never set.',
    '6092h 为每转一个单位，而 608Fh 给出了编码器分辨率：6092h 从未设置。',
  ],
  'scales.uncertainty.unit_and_feed': [
    '60A8h and 6092h give different numbers of units for a revolution.',
    '60A8h 与 6092h 给出的每转单位数不同。',
  ],
  'scales.uncertainty.linear': [
    'The unit is a length, and the travel per revolution is unknown.',
    '单位为长度，而每转行程未知。',
  ],
  'scales.uncertainty.not_stated': [
    'Neither the drive nor its description states the unit.',
    '驱动器及其描述文件均未说明单位。',
  ],
  'scales.uncertainty.unreadable': ['The stated unit is not known here.', '所给单位无法识别。'],
  'scales.uncertainty.behind_gear': [
    'It counts turns, and 6091h holds a gear ratio: it is not stated whether the turns are those of the motor or of the load.',
    '以转数计，而 6091h 中设有传动比：未说明是电机的转数还是负载的转数。',
  ],
  'scales.uncertainty.needs_resolution': [
    'It counts increments, and increments per revolution are unknown.',
    '以增量计，而每转增量数未知。',
  ],
  'scales.uncertainty.factor': [
    '6090h is another resolution than 608Fh, or 6096h or 6097h holds a factor: how the drive uses it is not stated.',
    '6090h 与 608Fh 的分辨率不同，或 6096h、6097h 中设有系数：驱动器如何使用它未予说明。',
  ],
  'scales.teach': ['Teach by a small move', '通过微小移动示教'],
  'scales.teachHelp': [
    'The axis moves by this number of increments within 2 s, with low torque. Mark the shaft and check how far it turns. Begin small: each move may be at most ten times as long as the one before.',
    '该轴在 2 秒内以小转矩移动所给增量数。请在轴上做标记，观察转过的角度。从小开始：每次移动最多为前一次的十倍。',
  ],
  'scales.increments': ['Increments', '增量数'],
  'scales.torque': ['Torque at most', '最大转矩'],
  'scales.move': ['Move by increments', '按增量移动'],
  'scales.turned': ['The shaft turned by', '轴转过'],
  'scales.turnedHelp': [
    'After {moved} increments. If the turn is too small to see, move further.',
    '移动 {moved} 个增量后。若看不出转动，请移动更多。',
  ],
  'scales.confirm': ['Confirm this turn', '确认转角'],
  'scales.reported': [
    '606Ch showed {value} per increment per second.',
    '每个增量/秒对应的 606Ch 值：{value}。',
  ],
  'scales.toldNothing': ['606Ch did not follow the position.', '606Ch 的值与位置不相符。'],
  'scales.state': ['State from a data sheet', '按数据手册给定'],
  'scales.countsPerRev': ['Increments per revolution', '每转增量数'],
  'scales.rawPerRpm': ['Raw speed of 1 rpm', '1 rpm 的原始速度值'],
  'scales.rawPerRpmS': ['Raw ramp of 1 rpm/s', '1 rpm/s 的原始加速度值'],
  'scales.keep': ['Save', '保存'],
  'scales.forget': ['Delete the stated values', '清除给定值'],
  'scales.expired': [
    'The stated values apply to another gear or unit of the drive and are not valid now.',
    '给定值对应驱动器的其他传动比或单位，目前无效。',
  ],
} satisfies Texts
