import type { Texts } from '../../types'

/** The bench in 3D. */
export const scene = {
  'page.scene': ['3D', '三维'],
  'scene.frame': ['The bench in 3D', '三维调试台'],
  'scene.help': [
    'Parts move with the measured positions. Above each motor: name of the axis, state and position. I: with torque, O: without, !: fault, ?: not known. Red posts are the software limits of the drive, the blue one is position zero. Drag to turn, wheel or two fingers to zoom. A track without limits extends over the positions seen so far; its length is not to scale.',
    '部件随实测位置运动。每个电机上方为轴名、状态和位置。I：有转矩，O：无转矩，!：有故障，?：未知。红柱为驱动器软件限位，蓝柱为位置 0。拖动可旋转，滚轮或双指可缩放。无限位的导轨按轴到达过的范围伸长，长度不按比例。',
  ],
  'scene.states': ['States of the axes', '各轴状态'],
  'scene.none': ['No axis is connected yet. Start with Connect.', '尚未连接任何轴，请先连接。'],
  'scene.shaft': ['a bare shaft', '裸轴（无负载）'],
  'scene.screw': ['a screw', '丝杠'],
  'scene.belt': ['a belt', '皮带'],
  'scene.rack': ['a rack', '齿条'],
  'scene.rotary': ['a rotary table', '转台'],
  'scene.drives': ['drives {what}', '带动{what}'],
  'scene.what': ['It drives', '所带机构'],
  'scene.keep': ['Keep', '保存'],
  'scene.keepHelp': [
    'Kept with the bench and shown here; nothing is written to the drive.',
    '随调试台保存并在此显示；不写入驱动器。',
  ],
  'scene.gear': ['Electronic gear of the drive', '驱动器的电子齿轮'],
  'scene.limits': ['Limits and home, in the drive', '驱动器中的限位与原点'],
  'scene.noLimits': [
    'No software limits of this drive can be reached over its connected port.',
    '通过已连接的端口无法访问此驱动器的软件限位。',
  ],
  'scene.axis': ['The axis in 3D', '轴的三维视图'],
  'scene.all': ['All axes', '全部轴'],
  'scene.show': ['Show', '显示'],
  'scene.hide': ['Hide', '隐藏'],
  'scene.closed': [
    'Shaft, load, limits and home, moving with the measured position.',
    '轴、负载、限位与原点，随实测位置运动。',
  ],
} satisfies Texts
