/** The network interface of an EtherCAT bus URL; empty for any other, and for virtual ones. */
export function interfaceOf(url: string): string {
  return /^ethercat:\/\/(?!virtual\d*$)([^/?\s]{1,15})$/.exec(url)?.[1] ?? ''
}

/** The serial port of a bus URL; empty for other buses, and for virtual ones. */
export function serialPortOf(url: string): string {
  const found = /^(?:(?:mlink|modbus):\/\/|canopen:\/\/slcan\/)([^?\s]+)/.exec(url)?.[1] ?? ''
  return /^virtual\d+$/.test(found) ? '' : found.replaceAll('%2F', '/').replaceAll('%2f', '/')
}
