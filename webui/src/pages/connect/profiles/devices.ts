import type { DescribedDevice, FoundDrive } from '../../../api/schema'

/** What a profile may be called; the server checks the same. */
export const PROFILE_NAME = /^[a-z][a-z0-9_]{0,59}$/

/** The device of a file that is the drive which was found: its newest revision not above it. */
export function deviceFor(
  devices: DescribedDevice[],
  found?: Pick<FoundDrive, 'product_code' | 'revision'>,
): number {
  if (!found || found.product_code === null) return 0
  const same = devices
    .map((device, number) => ({ ...device, number }))
    .filter((device) => device.product_code === found.product_code)
  const revision = found.revision
  const exact = same.find((device) => device.revision === revision)
  const older = same
    .filter((device) => revision === null || (device.revision ?? 0) <= revision)
    .sort((a, b) => (b.revision ?? 0) - (a.revision ?? 0))
  return (exact ?? older[0] ?? same[0])?.number ?? 0
}

export function deviceLabel(device: DescribedDevice): string {
  const hex = (number: number | null) =>
    number === null ? '' : ` 0x${number.toString(16).toUpperCase()}`
  return `${device.name}${hex(device.product_code)}${hex(device.revision)}`
}
