import { describe, expect, it } from 'vitest'
import type {
  CursorMoved,
  InvitationView,
  PeopleHere,
  PersonHere,
  PlotCursor,
} from '../../../api/schema'
import { cursorsOn, heldInside, isShared, Pointing } from './cursors'

function here(state: InvitationView['state'], pages: Record<string, string>): PeopleHere {
  return {
    type: 'people',
    people: Object.entries(pages).map(([connection, page]) => ({
      connection,
      page,
    })) as PersonHere[],
    invitations: [{ state } as InvitationView],
    rights: [],
  }
}

const cursor = (
  connection: string,
  x: number | null,
  plot: CursorMoved['plot'] = 'response',
  y: number | null = null,
) =>
  ({
    type: 'cursor_moved',
    connection,
    person: `P ${connection}`,
    plot,
    x,
    y,
  }) satisfies CursorMoved

describe('cursors of others', () => {
  const pages = { c1: '/axis/x/response', c2: '/axis/y/response' }
  const all = [cursor('c1', 120), cursor('c2', 90), cursor('gone', 80)]
  it('are those of the same plot on the same page', () => {
    const found = cursorsOn('response', '/axis/x/response', here('joined', pages), all)
    expect(found).toEqual([{ connection: 'c1', person: 'P c1', x: 120, y: null }])
    expect(cursorsOn('step', '/axis/x/response', here('joined', pages), all)).toEqual([])
  })
  it('have the frequency as well where a spectrogram was pointed at', () => {
    const [found] = cursorsOn('scope', '/axis/x/response', here('joined', pages), [
      cursor('c1', 1.5, 'scope', 120),
    ])
    expect(found).toMatchObject({ x: 1.5, y: 120 })
  })
  it('are not there without a guest', () => {
    for (const state of ['open', 'ended'] as const) {
      expect(isShared(here(state, pages))).toBe(false)
      expect(cursorsOn('response', '/axis/x/response', here(state, pages), all)).toEqual([])
    }
    expect(isShared(null)).toBe(false)
  })
  it('are held at the edge where their place is out of sight', () => {
    expect(heldInside(-3, 400)).toEqual({ left: 0, beyond: -1 })
    expect(heldInside(200, 400)).toEqual({ left: 200, beyond: 0 })
    expect(heldInside(401, 400)).toEqual({ left: 400, beyond: 1 })
  })
})

describe('pointing', () => {
  function make() {
    const sent: PlotCursor[] = []
    return { sent, pointing: new Pointing((message) => sent.push(message)) }
  }
  const reported = (plot: PlotCursor['plot'], x: number | null, y: number | null = null) => ({
    type: 'plot_cursor',
    plot,
    x,
    y,
  })
  const at = (x: number, y: number | null = null) => ({ x, y })

  it('shows a place once, and again when the picture has moved beneath the pointer', () => {
    const { sent, pointing } = make()
    let x = 1.5
    pointing.enter('scope', () => at(x))
    pointing.tick(true)
    pointing.tick(true)
    x = 1.6
    pointing.tick(true)
    expect(sent).toEqual([reported('scope', 1.5), reported('scope', 1.6)])
  })
  it('reports another frequency at the same time', () => {
    const { sent, pointing } = make()
    let y = 50
    pointing.enter('scope', () => at(1.5, y))
    pointing.tick(true)
    pointing.tick(true)
    y = 60
    pointing.tick(true)
    expect(sent).toEqual([reported('scope', 1.5, 50), reported('scope', 1.5, 60)])
  })
  it('says nothing while nobody is reported, and takes back what it said', () => {
    const { sent, pointing } = make()
    pointing.enter('scope', () => at(1))
    pointing.tick(false)
    expect(sent).toEqual([])
    pointing.tick(true)
    pointing.tick(false)
    pointing.tick(false)
    expect(sent).toEqual([reported('scope', 1), reported('scope', null)])
  })
  it('takes back the old plot before it reports the new one', () => {
    const { sent, pointing } = make()
    const first = () => at(5)
    pointing.enter('response', first)
    pointing.tick(true)
    pointing.enter('step', () => at(0.2))
    pointing.leave(first) // the leave of the first may come after the enter of the second
    pointing.tick(true)
    expect(sent).toEqual([
      reported('response', 5),
      reported('response', null),
      reported('step', 0.2),
    ])
  })
  it('is over when the pointer leaves, or when the plot has no place for it', () => {
    const { sent, pointing } = make()
    let x: number | null = 7
    const read = () => (x === null ? null : at(x))
    pointing.enter('response', read)
    pointing.tick(true)
    x = null
    pointing.tick(true)
    x = 8
    pointing.tick(true)
    pointing.leave(read)
    pointing.tick(true)
    expect(sent.map((each) => each.x)).toEqual([7, null, 8, null])
  })
})
