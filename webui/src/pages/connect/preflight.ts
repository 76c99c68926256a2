/** The network interface of an EtherCAT bus URL; empty for any other, and for virtual ones. */
export function interfaceOf(url: string): string {
  return /^ethercat:\/\/(?!virtual\d*$)([^/?\s]{1,15})$/.exec(url)?.[1] ?? ''
}
