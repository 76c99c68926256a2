import type { Texts } from '../../types'

/** Connect page: name and network ports of a station with accounts. */
export const box = {
  'box.title': ['This station', '本站'],
  'box.first': [
    'The administrator is set. Now name the station and choose the network ports of the drives and of the office.',
    '管理员已设置。现在请为本站命名，并指定哪个网口连接驱动器、哪个网口连接办公网络。',
  ],
  'box.summary': [
    '{name}: EtherCAT on {ethercat}, office on {office}.',
    '{name}：EtherCAT 使用 {ethercat}，办公网络使用 {office}。',
  ],
  'box.open': ['not set', '未指定'],
  'box.change': ['Change', '更改'],
  'box.name': ['Name in the network', '网络名称'],
  'box.nameHelp': [
    'Letters a to z, digits and hyphens, such as cabinet-3. After the next start of the server the page is also at NAME.local.',
    '字母 a 到 z、数字和连字符，例如 cabinet-3。服务器下次启动后，也可通过 名称.local 打开页面。',
  ],
  'box.ethercat': ['Port of the drives (EtherCAT)', '驱动器网口（EtherCAT）'],
  'box.office': ['Port of the office', '办公网口'],
  'box.officeHelp': [
    'The server never sends EtherCAT frames on this port. Without an IP address on this port, the name of the station is not announced.',
    '服务器从不在此网口发送 EtherCAT 帧。该网口没有 IP 地址时，不会公布站名。',
  ],
  'box.here': ['this page', '本页面'],
  'box.down': ['no link', '无链路'],
  'box.keep': ['Save', '保存'],
} satisfies Texts
