import type { Texts } from '../../types'

/** The guided tour of the demo. It names buttons by the words that stand on them. */
export const tour = {
  'tour.title': ['Guided tour', '引导教程'],
  'tour.offer': [
    'Learn the steps from jog to undo on a virtual axis in five minutes. No real machine is connected. An axis moves only when you press its button.',
    '用五分钟在虚拟轴上学习从点动到撤销的流程。没有连接真实机器。只有在您按下按钮时轴才会运动。',
  ],
  'tour.start': ['Start the tour', '开始教程'],
  'tour.later': ['Not now', '以后再说'],
  'tour.leave': ['Leave the tour', '退出教程'],
  'tour.back': ['Back', '上一步'],
  'tour.next': ['Next', '下一步'],
  'tour.skip': ['Skip this step', '跳过此步'],
  'tour.end': ['Finish', '完成'],
  'tour.open': ['Open {page}', '打开“{page}”'],
  'tour.done': ['Done.', '已完成。'],
  'tour.place': ['Step {now} of {count}', '第 {now} 步，共 {count} 步'],
  'tour.menu': ['Guided tour', '引导教程'],
  'tour.step.look': ['The axis', '认识轴'],
  'tour.text.look': [
    'This is {axis}: a virtual servo drive on EtherCAT that turns a screw. The page shows its state, its values and the load in 3D. STOP at the top right stops all axes on every page, as does Esc.',
    '这是 {axis}：EtherCAT 上的虚拟伺服驱动器，带动一根丝杠。页面显示其状态、数值和 3D 负载。右上角的“停止”在任何页面都会停止所有轴，按 Esc 也一样。',
  ],
  'tour.step.jog': ['Jog', '点动'],
  'tour.text.jog': [
    'Hold the + button on {page} for about a second, then release it. The axis moves only while you hold the button. Speed, travel and torque stay within the limits above the button.',
    '在“{page}”页面按住 + 按钮约一秒后松开。只有按住时轴才运动。速度、行程和转矩保持在按钮上方的限值之内。',
  ],
  'tour.step.response': ['Frequency response', '频率响应'],
  'tour.text.response': [
    'Press “{button}” on {page}. The drive excites the axis for a few seconds within the limits. The plot then shows the mechanics with the resonance of the screw.',
    '在“{page}”页面按“{button}”。驱动器在限值内激励轴几秒钟。随后曲线显示机械特性以及丝杠的谐振。',
  ],
  'tour.step.tune': ['Tune', '整定'],
  'tour.text.tune': [
    'Press “{button}” on {page}. The job measures inertia and response, designs notches and gains, writes them and verifies the result. It takes about a minute.',
    '在“{page}”页面按“{button}”。任务测量惯量和频率响应，设计陷波和增益，写入并验证结果。大约需要一分钟。',
  ],
  'tour.step.fault': ['Fault', '故障'],
  'tour.text.fault': [
    'Press “{cause}” here: the virtual drive reports an under-voltage. Read its cause and remedy on {page}, then press “{button}” there.',
    '在此按“{cause}”：虚拟驱动器报告欠压。在“{page}”页面阅读原因和处理方法，然后按“{button}”。',
  ],
  'tour.cause': ['Cause a fault', '触发故障'],
  'tour.step.undo': ['Undo', '撤销'],
  'tour.text.undo': [
    'Press “{button}” on {page}: the gains and notches from before the tuning are written back. Nothing is stored in the drive until you save it.',
    '在“{page}”页面按“{button}”：写回整定之前的增益和陷波。在您保存之前，驱动器中不会存储任何更改。',
  ],
  'tour.undoNothing': [
    'Nothing was tuned in this tour, so there is nothing to undo.',
    '本教程中未进行整定，因此没有可撤销的内容。',
  ],
  'tour.step.end': ['End of the tour', '教程结束'],
  'tour.text.end': [
    'Go on with the first drive in the documentation. The tour can be started again from the menu of settings at the top.',
    '请继续阅读文档中的“第一台驱动器”。可从顶部的设置菜单再次启动本教程。',
  ],
} as const satisfies Texts
