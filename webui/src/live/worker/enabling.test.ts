import { describe, expect, it } from 'vitest'
import { EnablingHold, SILENCE_MS } from './enabling'

function rig() {
  const sent: string[] = []
  let time = 0
  let open = true
  const hold = new EnablingHold(
    (message) => {
      if (open) sent.push(message.type)
      return open
    },
    () => time,
  )
  return {
    hold,
    sent,
    pass: (ms: number) => (time += ms),
    close: () => (open = false),
  }
}

describe('the enabling button', () => {
  it('renews while the page is heard and releases when it falls silent', () => {
    const { hold, sent, pass } = rig()
    hold.press('i')
    pass(SILENCE_MS)
    hold.tick()
    hold.beat()
    pass(SILENCE_MS)
    hold.tick()
    pass(1)
    hold.tick()
    expect(sent).toEqual(['enable_press', 'enable_renew', 'enable_renew', 'enable_release'])
  })
  it('is not revived by a page that wakes up', () => {
    const { hold, sent, pass } = rig()
    hold.press('i')
    pass(SILENCE_MS + 1)
    hold.beat()
    hold.tick()
    expect(sent).toEqual(['enable_press', 'enable_release'])
  })
  it('is let go once, and not at all without a connection', () => {
    const { hold, sent, close } = rig()
    hold.press('i')
    hold.release('released')
    hold.release('released')
    close()
    hold.press('i')
    hold.tick()
    expect(sent).toEqual(['enable_press', 'enable_release'])
  })
})

describe('a hold that the worker ends', () => {
  it('is reported to the page, which would else go on showing it as held', () => {
    let ended = 0
    let time = 0
    const hold = new EnablingHold(
      () => true,
      () => time,
      () => ended++,
    )
    hold.press('i')
    time = SILENCE_MS + 1
    hold.tick()
    expect(ended).toBe(1)
    hold.beat()
    hold.tick()
    hold.press('i')
    hold.release('released')
    expect(ended).toBe(1)
  })
  it('is reported also where its message could not be sent', () => {
    let ended = 0
    let open = false
    const hold = new EnablingHold(
      () => open,
      () => 0,
      () => ended++,
    )
    hold.press('i')
    expect(ended).toBe(1)
    open = true
    hold.press('i')
    open = false
    hold.tick()
    expect(ended).toBe(2)
  })
})
