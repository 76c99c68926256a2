import { describe, expect, it } from 'vitest'
import { interfaceOf } from './preflight'

describe('the interface of a bus URL', () => {
  it('is that of a real EtherCAT bus', () => {
    expect(interfaceOf('ethercat://eth0')).toBe('eth0')
    expect(interfaceOf('ethercat://enp3s0f1')).toBe('enp3s0f1')
  })

  it('other buses and virtual ones have none', () => {
    for (const url of ['', 'ethercat://virtual0', 'mlink:///dev/ttyUSB0', 'ethercat://a/b']) {
      expect(interfaceOf(url)).toBe('')
    }
  })
})
