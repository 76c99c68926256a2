import { describe, expect, it } from 'vitest'
import { interfaceOf, serialPortOf } from './preflight'

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

describe('the serial port of a bus URL', () => {
  it.each([
    ['mlink://COM3', 'COM3'],
    ['modbus:///dev/ttyUSB0?baudrate=115200&parity=N', '/dev/ttyUSB0'],
    ['canopen://slcan/COM12?bitrate=1000000', 'COM12'],
    ['canopen://slcan/%2Fdev%2FttyUSB1', '/dev/ttyUSB1'],
  ])('of %s is %s', (url, port) => expect(serialPortOf(url)).toBe(port))

  it.each(['', 'mlink://virtual0', 'ethercat://eth0', 'canopen://socketcan/can0', 'COM3'])(
    'is none of %s',
    (url) => expect(serialPortOf(url)).toBe(''),
  )
})
