import { describe, expect, it } from 'vitest'
import { figures } from './figures'

describe('figures of a link', () => {
  it('have their unit apart, and no name of a variable', () => {
    const [load, new_] = figures({ cyclic_bus_load_percent: 12.5, new_counter: 3 })
    expect(load).toMatchObject({ words: 'cyclic bus load', value: '12.5', unit: '%' })
    expect(new_).toMatchObject({ words: 'new counter', value: '3', unit: '' })
  })
  it('are reported once', () => {
    expect(figures({ cyclic_running: 0, late_below_64_us: 9, mailbox_repeats: 2 })).toEqual([])
  })
})
