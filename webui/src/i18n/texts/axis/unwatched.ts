import type { Texts } from '../../types'

/** Measurements on drives without a watchdog, and by the profile velocity. */
export const unwatched = {
  'unwatched.why': [
    'WARNING: no watchdog of this drive ends a speed command when this computer stops sending. If the cable is pulled or this program ends during the measurement, the axis keeps its last speed until its travel limit or the emergency stop acts.',
    '警告：本计算机停止发送时，该驱动器没有看门狗使速度指令终止。如果测量期间电缆被拔掉或程序终止，轴会保持最后的速度，直到驱动器的行程限位或急停起作用。',
  ],
  'unwatched.consent': [
    'I agree for this one measurement. The drive’s travel limits are active and a hand is on the emergency stop.',
    '我同意，仅限本次测量。驱动器的行程限位有效，且手已放在急停按钮上。',
  ],
  'unwatched.bySpeed': [
    'This drive has no cyclic mode. It is measured by its speed loop: in profile velocity with its ramps switched off for the measurement, one speed with every SYNC ({ms} ms). Torque to speed is known up to {direct} Hz, and up to {model} Hz where a model fits. First a quarter turn checks that it turns backwards at a negative speed.',
    '该驱动器没有周期模式，通过速度环测量：测量期间在轮廓速度模式下关闭斜坡，每个 SYNC（{ms} ms）给一个速度。转矩到速度的响应可达 {direct} Hz，模型拟合良好时可达 {model} Hz。首先转动四分之一圈，确认负速度时反转。',
  ],
} satisfies Texts
