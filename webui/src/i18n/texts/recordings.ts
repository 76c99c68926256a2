import type { Texts } from '../types'

/** The Recordings page with rerun's viewer. */
export const recordings = {
  'page.rerun': ['Recordings', '录制'],
  'recordings.start': ['Record', '开始录制'],
  'recordings.stop': ['End', '结束'],
  'recordings.what': [
    'Records {count} signals chosen on the Scope page.',
    '录制示波器页面所选的 {count} 个信号。',
  ],
  'recordings.name': ['Name', '名称'],
  'recordings.notes': ['Notes', '备注'],
  'recordings.search': ['Search recordings', '搜索录制'],
  'recordings.none': ['No recordings.', '没有录制。'],
  'recordings.free': ['{size} free', '剩余 {size}'],
  'recordings.facts': [
    '{duration} · {samples} samples · {size}',
    '{duration} · {samples} 个采样 · {size}',
  ],
  'recordings.lost': ['{count} samples lost', '丢失 {count} 个采样'],
  'recordings.state.waiting': ['waits for its trigger', '等待触发'],
  'recordings.state.recording': ['recording', '录制中'],
  'recordings.state.complete': ['complete', '完整'],
  'recordings.state.interrupted': ['cut off, good up to there', '被中断，之前的数据完好'],
  'recordings.state.failed': ['ended by a failure, good up to there', '因故障结束，之前的数据完好'],
  'recordings.state.unusable': ['not usable', '不可用'],
  'recordings.open': ['Open in rerun', '在 rerun 中打开'],
  'recordings.export': ['Export as {kind}', '导出为 {kind}'],
  'recordings.delete': ['Delete {name}', '删除 {name}'],
  'recordings.deleteText': ['It cannot be brought back.', '删除后无法恢复。'],
  'recordings.deleteNow': ['Delete', '删除'],
  'rerun.title': ['Viewer', '查看器'],
  'rerun.live': ['Show live', '实时显示'],
  'rerun.close': ['Close the viewer', '关闭查看器'],
  'rerun.help': [
    'Live signals of all axes, or a stored recording, in rerun. The viewer is large; it is loaded when it is opened.',
    '在 rerun 中查看所有轴的实时信号或已存录制。查看器较大，打开时才加载。',
  ],
  'rerun.loading': ['Loading the viewer: {percent} %', '正在加载查看器：{percent} %'],
  'rerun.started': ['The viewer is starting.', '查看器正在启动。'],
  'rerun.showing': ['Live: {size} received', '实时：已接收 {size}'],
  'rerun.dropped': [
    '{count} chunks were dropped because this page was too slow. Recordings are not affected.',
    '由于此页面过慢，丢弃了 {count} 个数据块；录制不受影响。',
  ],
  'rerun.stored': ['Stored recording: {name}', '已存录制：{name}'],
  'rerun.lost': ['The connection is lost. It is tried again.', '连接已断开，正在重试。'],
  'rerun.broken': [
    'The viewer has failed. Close and open it again.',
    '查看器出现故障，请关闭后重新打开。',
  ],
} satisfies Texts
