import type { Texts } from '../../types'

/** Connect page: drives that are not listed, line settings, further ports. */
export const notListed = {
  'notListed.title': ['My drive is not listed', '列表中没有我的驱动器'],
  'notListed.open': ['Not the right one? Import its description', '没有合适的？导入描述文件'],
  'notListed.lead': [
    'Any CiA 402 drive works with its maker’s description: an ESI file (EtherCAT, .xml) or an EDS or DCF file (CANopen). The profile made from it is usable at once.',
    '任何 CiA 402 驱动器都可以使用厂家描述文件：ESI 文件（EtherCAT，.xml）或 EDS、DCF 文件（CANopen）。生成的配置文件可立即使用。',
  ],
  'notListed.choose': ['Choose a file…', '选择文件…'],
  'notListed.file': ['Description file', '描述文件'],
  'notListed.device': ['Device in this file', '文件中的设备'],
  'notListed.name': ['Name of the new profile', '新配置文件名称'],
  'notListed.nameHelp': [
    'lower-case letters, digits and underscore; empty: name of the device',
    '小写字母、数字和下划线；留空则用设备名',
  ],
  'notListed.nameBad': ['lower-case letters, digits and underscore', '小写字母、数字和下划线'],
  'notListed.import': ['Import', '导入'],
  'notListed.fromDrive': ['Read it from the drive itself', '从驱动器读取'],
  'notListed.fromDriveHelp': [
    'EtherCAT drives may list their own objects, a few CANopen drives carry their EDS. The maker’s file contains more: units, limits and defaults.',
    'EtherCAT 驱动器可列出自身对象，少数 CANopen 驱动器内含 EDS。厂家文件信息更全：单位、限值和默认值。',
  ],
  'notListed.made': [
    '{title}: {count} {count|parameter|parameters}, as {profile}',
    '{title}：{count} 个参数，名为 {profile}',
  ],
  'notListed.path': ['To improve it, edit {path}', '如需完善，请编辑 {path}'],
  'notListed.odd': ['Irregularities: {count}', '异常之处：{count}'],
  'notListed.more': ['and {count} more', '以及另外 {count} 项'],
  'notListed.otherProduct': [
    'The description is of another product: it states vendor {vendor}, product {product}; the drive reports vendor {driveVendor}, product {driveProduct}.',
    '描述文件属于其他产品：文件为厂商 {vendor}、产品 {product}；驱动器为厂商 {driveVendor}、产品 {driveProduct}。',
  ],
  'notListed.before': [
    'WARNING: units and limits come from the file and may be wrong. Before you move the axis, turn the shaft by hand and compare the position, then jog slowly with the motor uncoupled.',
    '警告：单位和限值来自文件，可能有误。移动轴之前，请用手转动电机轴并核对位置，然后将电机与负载脱开，低速点动。',
  ],
  'notListed.outcome.repaired': ['repaired', '已修复'],
  'notListed.outcome.left out': ['left out', '已忽略'],
  'notListed.outcome.noted': ['noted', '注意'],
  'notListed.export': ['Export a profile as EDS or ESI', '将配置文件导出为 EDS 或 ESI'],
  'notListed.exportEds': ['Export as EDS', '导出为 EDS'],
  'notListed.exportEsi': ['Export as ESI', '导出为 ESI'],
  'notListed.broken': [
    'Your profile cannot be used: {problem}',
    '您的这个配置文件无法使用：{problem}',
  ],
  'line.search': ['Search baud rate and parity', '搜索波特率和奇偶校验'],
  'line.help': [
    'Tries the usual settings at the stations given above (station 1 if none). Only reads are sent.',
    '在上面给出的站地址（未填则为 1）尝试常用设置，仅进行读取。',
  ],
  'line.found': ['It answers with {url}', '应答设置：{url}'],
  'line.use': ['Use it', '使用'],
  'line.none': [
    'Nothing answered at any of these settings. Check power, wiring and the station address.',
    '所有设置下均无应答。请检查电源、接线和站地址。',
  ],
  'port.missing': [
    'Not connected over {kind}: {count} {count|parameter is|parameters are} available only there ({groups}).',
    '未通过 {kind} 连接：有 {count} 个参数只能通过该端口访问（{groups}）。',
  ],
  'port.missingNothing': ['It can be connected over {kind} too.', '也可以通过 {kind} 连接。'],
  'port.connect': ['Connect {kind} too', '同时连接 {kind}'],
  'port.url': ['Bus URL', '总线 URL'],
  'port.station': ['Station', '站地址'],
  'port.accept': ['It is the same drive: connect anyway', '是同一台驱动器：仍然连接'],
} satisfies Texts
