import { describe, expect, it } from 'vitest'
import {
  filtered,
  fixed,
  gridOf,
  hertz,
  loadCurve,
  logTicks,
  measuredCurve,
  nearest,
  notchFor,
  onGrid,
  partOf,
  rangeOf,
  toCsv,
  wrapWhole,
} from './bode'
import { bodeSvg } from './picture'
import { asAutotune, asSweep, filesOf, type Sweep } from '../results'

const sweep: Sweep = {
  kind: 'mechanics',
  loop: 'none',
  sample_rate_hz: 1000,
  valid_band_hz: [5, 250],
  frequency_hz: [5, 50, 100, 400],
  magnitude_db: [40, 20, 30, -3],
  phase_deg: [270, 265, 200, 90],
  coherence: [0.99, 0.98, 0.2, 0.9],
  std_db: [0.1, 0.5, null, 1],
  std_deg: [1, 2, null, 4],
  resonances: [],
  margins: {},
  unit: '(rad/s)/Nm',
  trusted: true,
  motion_s: 4,
  saturated_share: 0,
  warnings: [],
}

describe('a measured curve', () => {
  const curve = measuredCurve(sweep, 'measured', '#0072b2')
  it('leaves out lines that are drowned in noise', () => {
    expect(curve.magnitude).toEqual([40, 20, null, -3])
    expect(curve.phase[2]).toBeNull()
  })
  it('shows the phase within one turn at the low end, still unwrapped', () => {
    expect(curve.phase).toEqual([-90, -95, null, -270])
    expect(wrapWhole([-90, -180], [1, 2])).toEqual([-90, -180])
    expect(wrapWhole([-730, -800], [1, 2])).toEqual([-10, -80])
  })
  it('has a 95 % band of 1.96 standard deviations to each side', () => {
    const { values, low, high } = partOf(curve, 'magnitude')
    expect(values[1]).toBe(20)
    expect(high[1]).toBeCloseTo(20.98, 6)
    expect(low[1]).toBeCloseTo(19.02, 6)
    expect(low[2]).toBeNull()
    expect(partOf(curve, 'coherence').low).toEqual([])
  })
  it('behind a filter is the sum in dB and in degrees', () => {
    const behind = filtered(curve, [0, -20, -20, 0], [0, -10, 0, 10], 'with', '#c24a00')
    expect(behind.magnitude).toEqual([40, 0, null, -3])
    expect(behind.phase).toEqual([-90, -105, null, -260])
  })
})

describe('several curves', () => {
  const a = { ...measuredCurve(sweep, 'a', '#000000') }
  const b = { ...a, label: 'b', frequency: [5, 60, 120], magnitude: [1, null, 2], phase: [0, 0, 0] }
  it('share an ascending grid with each frequency once', () => {
    expect(gridOf([a, b])).toEqual([5, 50, 60, 100, 120, 400])
  })
  it('keep their gaps, and are not cut where only another one has a line', () => {
    expect(onGrid(gridOf([a, b]), b.frequency, b.magnitude)).toEqual([
      1,
      undefined,
      null,
      undefined,
      2,
      undefined,
    ])
  })
  it('are scaled by what is in sight', () => {
    expect(rangeOf([a], 'magnitude', [5, 250])).toEqual([10, 50])
    expect(rangeOf([a], 'magnitude', [5, 400])).toEqual([-10, 50])
    expect(rangeOf([], 'phase', [5, 400])).toEqual([-180, 180])
  })
})

describe('the frequency axis', () => {
  it('has 1, 2 and 5 of every decade', () => {
    expect(logTicks(5, 400)).toEqual([5, 10, 20, 50, 100, 200])
  })
  it('finds the nearest line by ratio, not by distance', () => {
    expect(nearest([10, 100], 30)).toBe(0)
    expect(nearest([10, 100], 33)).toBe(1)
    expect(nearest([], 33)).toBe(-1)
  })
  it('is written with few digits', () => {
    expect(hertz(12.345)).toBe('12.35 Hz')
    expect(hertz(1250)).toBe('1.25 kHz')
    expect(hertz(null)).toBe('—')
    expect(fixed(-3.14159, 1, 'dB')).toBe('−3.1 dB')
    expect(fixed(-90, 0, '°')).toBe('−90°')
    expect(fixed(Number.NaN, 1)).toBe('—')
  })
})

const withLoad: Sweep = {
  ...sweep,
  load: {
    valid_band_hz: [5, 60],
    frequency_hz: [5, 50, 100],
    magnitude_db: [40, 22, 31],
    phase_deg: [270, 240, 100],
    coherence: [0.99, 0.95, 0.9],
    std_db: [0.1, 0.3, 1],
    std_deg: [1, null, 2],
    counts_per_motor_rev: 131072,
  },
}

describe('the load', () => {
  it('is drawn within its band, with its coherence', () => {
    const curve = loadCurve(withLoad, 'load', '#00805e')
    expect(curve?.magnitude).toEqual([40, 22, null])
    expect(curve?.phase).toEqual([-90, -120, null])
    expect(curve?.coherence).toEqual([0.99, 0.95, 0.9])
    expect(curve?.stdMagnitude).toEqual([0.1, 0.3, 1])
  })
  it('is not drawn where there is no second encoder', () => {
    expect(loadCurve(sweep, 'load', '#00805e')).toBeNull()
  })
})

describe('export', () => {
  it('has every line, also those without a deviation', () => {
    const rows = toCsv(sweep).split('\r\n')
    expect(rows[0]).toBe(
      'frequency_hz,magnitude_db [(rad/s)/Nm],phase_deg,coherence,std_db,std_deg',
    )
    expect(rows[3]).toBe('100,30,200,0.2,,')
    expect(rows).toHaveLength(6)
  })
  it('has the load beside the motor, and nothing of it on lines that it lacks', () => {
    const rows = toCsv(withLoad).split('\r\n')
    expect(rows[0]).toBe(
      'frequency_hz,magnitude_db [(rad/s)/Nm],phase_deg,coherence,std_db,std_deg,' +
        'load_magnitude_db [(rad/s)/Nm],load_phase_deg,load_coherence,load_std_db,load_std_deg',
    )
    expect(rows[2]).toBe('50,20,265,0.98,0.5,2,22,240,0.95,0.3,')
    expect(rows[4]).toBe('400,-3,90,0.9,1,4,,,,,')
  })
  it('draws a picture with escaped words and a gap where a line is missing', () => {
    const svg = bodeSvg(
      [measuredCurve(sweep, 'a < b', '#0072b2')],
      'X & Y',
      sweep.unit,
      sweep.valid_band_hz,
    )
    expect(svg).toContain('X &amp; Y')
    expect(svg).toContain('a &lt; b')
    const path = /<path d="([^"]+)"/.exec(svg)?.[1] ?? ''
    expect(path.match(/M/g)).toHaveLength(2)
    expect(svg).not.toContain('NaN')
  })
})

describe('results of jobs', () => {
  it('are distinguished', () => {
    expect(asSweep(sweep)).toBe(sweep)
    expect(asSweep({ verdict: 'good' })).toBeNull()
    expect(asAutotune(null)).toBeNull()
    expect(filesOf({ measurements: ['a.sdmeas', 3] })).toEqual(['a.sdmeas'])
    expect(filesOf(null)).toEqual([])
  })
})

describe('a proposed notch', () => {
  it('is as deep as the resonance is high, within what is sensible', () => {
    expect(notchFor(200, 0.01, 18)).toEqual({ center_hz: 200, width_hz: 60, depth_db: -18 })
    expect(notchFor(200, 0.2, 60)).toEqual({ center_hz: 200, width_hz: 160, depth_db: -30 })
  })
})
