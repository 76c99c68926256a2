import type { Texts } from '../../types'

/** Connect page: whether this computer is punctual enough. */
export const preflight = {
  'preflight.title': ['Preflight of the computer', '计算机预检'],
  'preflight.help': [
    'Lists what hinders punctual EtherCAT on the computer that runs servodeck, the most effective remedy first. The measurement reads one register of all slaves on the interface chosen above; nothing is written to a drive.',
    '列出运行 servodeck 的计算机上妨碍 EtherCAT 准时运行的因素，改善效果最大的排在最前。测量时只读取上方所选接口上所有从站的一个寄存器，不向驱动器写入任何内容。',
  ],
  'preflight.look': ['Check', '检查'],
  'preflight.measure': ['Measure for 10 s', '测量 10 秒'],
  'preflight.none': [
    'Nothing was found that hinders punctual EtherCAT.',
    '未发现妨碍 EtherCAT 准时运行的因素。',
  ],
  'preflight.first': ['Would help most', '改善效果最大'],
  'preflight.effect.blocks': ['no frame gets through', '帧无法通过'],
  'preflight.effect.interrupts': ['the bus can fail during operation', '总线可能在运行中中断'],
  'preflight.effect.delays': ['up to {delay} µs late', '最多延迟 {delay} µs'],
  'preflight.purpose': ['Purpose', '用途'],
  'preflight.verdict': ['Verdict', '结论'],
  'preflight.measured': ['Measured {when}', '测量于 {when}'],
  'preflight.cycle': ['Cycle {period} µs', '周期 {period} µs'],
  'preflight.figures': [
    '{missed} of {cycles} cycles missed; 99.9 % late by at most {late} µs, the latest {most} µs',
    '{cycles} 个周期中错过 {missed} 个；99.9 % 的延迟不超过 {late} µs，最大 {most} µs',
  ],
  'preflight.trip': [
    'Round trip of a frame: {median} µs, at most {most} µs',
    '帧往返时间：{median} µs，最大 {most} µs',
  ],
  'preflight.unanswered': [
    'No frame came back. Check cable, interface and the supply of the drives.',
    '没有帧返回。请检查电缆、接口和驱动器供电。',
  ],
  'preflight.fifo': ['real-time scheduling granted', '已授予实时调度'],
  'preflight.noFifo': ['real-time scheduling not granted', '未授予实时调度'],
  'preflight.histogram': [
    'Wake-up lateness: number of cycles per class',
    '唤醒延迟：各区间的周期数',
  ],
  'preflight.class': ['up to {edge} µs: {count}', '不超过 {edge} µs：{count}'],
  'preflight.classAbove': ['more than {edge} µs: {count}', '超过 {edge} µs：{count}'],
  'preflight.changed': [
    '{count} settings of the computer are changed and can be restored.',
    '已更改计算机的 {count} 项设置，可以恢复。',
  ],
  'preflight.undo': ['Restore', '恢复'],
  'preflight.left': [
    'Left as they are, because they were changed since: {settings}',
    '以下设置此后被更改过，保持不变：{settings}',
  ],
  'latency.is': [
    'The adapter at {device} holds answers back for up to {ms} ms (latency timer).',
    '{device} 上的适配器最多延迟应答 {ms} ms（延迟计时器）。',
  ],
  'latency.bound': [
    'By it alone at most {reads} reads per second, one after another.',
    '仅由它决定，逐次读取每秒最多 {reads} 次。',
  ],
  'latency.measured': [
    'Measured on this bus: {reads} reads per second.',
    '在此总线上测得：每秒 {reads} 次读取。',
  ],
  'latency.before': ['Before servodeck changed it: {ms} ms.', 'servodeck 更改之前：{ms} ms。'],
  'latency.measuredBefore': [
    'Measured then: {reads} reads per second.',
    '当时测得：每秒 {reads} 次读取。',
  ],
  'latency.replug': [
    'Not yet in force: unplug {device} and plug it in again.',
    '尚未生效：请拔下 {device} 再插上。',
  ],
  'latency.gain': [
    'At {ms} ms at most {reads} reads per second are possible: computed, not measured.',
    '设为 {ms} ms 时每秒最多可读取 {reads} 次：计算值，未测量。',
  ],
  'latency.restarts': [
    'The change restarts the adapter and needs an administrator of the computer; close its bus first.',
    '更改会重启适配器，并需要计算机管理员权限；请先关闭其总线。',
  ],
  'latency.lower': ['Lower to {ms} ms', '调低到 {ms} ms'],
  'latency.restore': ['Restore {ms} ms', '恢复为 {ms} ms'],
} satisfies Texts
