import { describe, expect, it } from 'vitest'
import { BUSY_MS, JogHold } from './jog-hold'

function make() {
  const log: string[] = []
  const page = { visible: true, focus: true, now: 0 }
  let pending: (() => void) | null = null
  const hold = new JogHold(
    {
      start: (direction) => log.push(`start ${direction}`),
      beat: () => log.push('beat'),
      stop: (reason) => log.push(`stop ${reason}`),
      changed: () => {},
    },
    {
      isVisible: () => page.visible,
      hasFocus: () => page.focus,
      requestFrame: (callback) => {
        pending = callback
        return 1
      },
      cancelFrame: () => {
        pending = null
      },
      now: () => page.now,
    },
  )
  const draw = () => {
    const callback = pending
    pending = null
    callback?.()
  }
  return { log, page, hold, draw }
}

describe('jog hold', () => {
  it('beats with every drawn frame until it is released', () => {
    const { log, hold, draw } = make()
    hold.press(1)
    draw()
    draw()
    hold.release('released')
    draw()
    expect(log).toEqual(['start 1', 'beat', 'beat', 'stop released'])
  })
  it('answers the worker between two frames, as plots may take long to draw', () => {
    const { log, page, hold } = make()
    hold.press(1)
    for (page.now = 40; page.now <= 400; page.now += 40) hold.asked()
    expect(log.filter((line) => line === 'beat')).toHaveLength(10)
    page.visible = false
    hold.asked()
    expect(log.at(-1)).toBe('stop page-hidden')
    hold.asked()
    expect(log.at(-1)).toBe('stop page-hidden')
  })
  it('counts only a drawn frame after it was busy, as a release may be waiting', () => {
    const { log, page, hold, draw } = make()
    hold.press(1)
    page.now = BUSY_MS + 1
    hold.asked()
    expect(log).toEqual(['start 1'])
    // The browser hands over the input that waited, then draws.
    hold.release('released')
    draw()
    hold.asked()
    expect(log).toEqual(['start 1', 'stop released'])
  })
  it('goes on with the frame that is drawn when nothing was released', () => {
    const { log, page, hold, draw } = make()
    hold.press(1)
    page.now = 300
    hold.asked()
    draw()
    page.now = 340
    hold.asked()
    expect(log).toEqual(['start 1', 'beat', 'beat'])
  })
  it('ends when the page is hidden or loses the focus', () => {
    for (const what of ['visible', 'focus'] as const) {
      const { log, page, hold, draw } = make()
      hold.press(-1)
      page[what] = false
      draw()
      expect(log.at(-1)).toMatch(/^stop/)
      expect(hold.held).toBeNull()
    }
  })
  it('does not start in a page that is not looked at', () => {
    const { log, page, hold } = make()
    page.focus = false
    expect(hold.press(1)).toBe(false)
    expect(log).toEqual([])
  })
  it('takes a second press for a wish to stop', () => {
    const { log, hold } = make()
    hold.press(1)
    expect(hold.press(-1)).toBe(false)
    expect(log).toEqual(['start 1', 'stop another-key'])
    expect(hold.held).toBeNull()
  })
})
