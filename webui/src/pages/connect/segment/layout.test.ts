import { describe, expect, it } from 'vitest'
import type { SegmentPort, SegmentStation } from '../../../api/schema'
import { barHeight, places, shownBins } from './layout'

const port = (number: number, findings: string[] = []): SegmentPort => ({
  number,
  link: true,
  communicating: true,
  lost_links: 0,
  rx_errors: 0,
  invalid_frames: 0,
  forwarded_errors: 0,
  findings,
})

const station = (
  number: number,
  behind: number,
  change: Partial<SegmentStation> = {},
): SegmentStation => ({
  station: number,
  name: `S${number}`,
  drive: null,
  vendor_id: 0,
  product_code: 0,
  revision: 0,
  serial: null,
  alias: 0,
  firmware: '',
  answers: true,
  state: 'OP',
  error: '',
  remedy: '',
  behind_station: behind,
  behind_port: behind === 0 ? 0 : 1,
  distributed_clock: true,
  reference_clock: false,
  clock_ahead_ns: 0,
  ports: [0, 1, 2, 3].map((each) => port(each)),
  findings: [],
  notes: [],
  note_messages: [],
  foe: false,
  ...change,
})

describe('the picture of a segment', () => {
  it('is a line for a line', () => {
    const found = places([station(1, 0), station(2, 1), station(3, 2)])
    expect(found.map(({ column, row }) => [column, row])).toEqual([
      [1, 0],
      [2, 0],
      [3, 0],
    ])
    expect(found.map((each) => each.cable)).toEqual(['good', 'good', 'good'])
  })
  it('has a row of its own for every branch', () => {
    const found = places([
      station(1, 0),
      station(2, 1, { behind_port: 3 }),
      station(3, 2),
      station(4, 1),
    ])
    expect(found.map(({ column, row, parentRow }) => [column, row, parentRow])).toEqual([
      [1, 0, 0],
      [2, 0, 0],
      [3, 0, 0],
      [2, 1, 0],
    ])
  })
  it('breaks the cable before the first one that does not answer, and only that', () => {
    const lost = { answers: false, state: '' }
    const found = places([station(1, 0), station(2, 1, lost), station(3, 2, lost)])
    expect(found.map((each) => each.cable)).toEqual(['good', 'broken', 'beyond'])
  })
  it('hears both ends of a cable, and says the same thing once', () => {
    const one = station(1, 0, { ports: [port(0), port(1, ['link lost']), port(2), port(3)] })
    const two = station(2, 1, { ports: [port(0, ['link lost', 'damaged']), port(1)] })
    const found = places([one, two])
    expect(found.map((each) => each.cable)).toEqual(['good', 'errors'])
    expect(found[1]?.findings).toEqual(['link lost', 'damaged'])
  })
  it('is empty without stations', () => {
    expect(places([])).toEqual([])
  })
})

describe('the histogram', () => {
  it('ends with its last bar', () => {
    const bins = [0, 5, 0, 1, 0, 0].map((count) => ({ count }))
    expect(shownBins(bins)).toHaveLength(4)
    expect(shownBins([{ count: 0 }, { count: 0 }])).toHaveLength(1)
  })
  it('shows single ones next to a million', () => {
    expect(barHeight(1_000_000, 1_000_000)).toBe(1)
    expect(barHeight(1, 1_000_000)).toBeGreaterThan(0.04)
    expect(barHeight(0, 1_000_000)).toBe(0)
  })
})
