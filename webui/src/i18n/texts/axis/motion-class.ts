import type { Texts } from '../../types'

/** Whether writing an object can cause motion, and who says so. */
export const motionClass = {
  'motionClass.title': ['Effect on motion', '对运动的影响'],
  'motionClass.none': ['Cannot cause motion', '不会引起运动'],
  'motionClass.at_enable': [
    'Changes how the axis moves; set only while it is disabled',
    '影响轴的运动方式；仅在未使能时可设置',
  ],
  'motionClass.safe': [
    'Changes how the axis moves; may be set while it is enabled',
    '影响轴的运动方式；使能时也可设置',
  ],
  'motionClass.energises': [
    'Can energise the motor or release the brake',
    '可能使电机得电或松开抱闸',
  ],
  'motionClass.origin.standard': ['By the standard', '依据标准'],
  'motionClass.origin.profile': ['By the manual', '依据手册'],
  'motionClass.origin.person': ['Set by a person of this station', '由本站人员指定'],
  'motionClass.origin.unclassified': [
    'The effect of this object is not known, so it is treated as one that energises the motor.',
    '该对象的作用未知，因此按可能使电机得电处理。',
  ],
  'motionClass.change': ['Change the class', '更改类别'],
  'motionClass.warning': [
    'WARNING: with a wrong class, writing a parameter can move the axis. Choose a class by the manual of the drive, or by a test with the load removed. The change is recorded in the audit trail.',
    '警告：类别错误时，写入参数可能使轴运动。请依据驱动器手册，或脱开负载试验后选择类别。更改将记入审计记录。',
  ],
  'motionClass.class': ['Class', '类别'],
  'motionClass.reason': ['Reason (page of the manual, test)', '依据（手册页码、试验）'],
  'motionClass.give': ['Set the class', '设置类别'],
  'motionClass.forget': ['Remove the class', '取消类别'],
} satisfies Texts
