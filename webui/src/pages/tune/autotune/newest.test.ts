import { describe, expect, it } from 'vitest'
import { newestInertia } from './newest'

describe('the inertia of an axis', () => {
  const inertia = (inertia_kgm2: number) => ({
    inertia_kgm2,
    ci95: {},
    verdict: '',
    identifiable: true,
    unit: 'SI',
  })
  const alone = { started: '2026-11-21T10:00:00Z', result: inertia(0.001) }
  const tuning = (started: string) => ({
    started,
    result: { mechanics: {}, candidates: [], before: {}, inertia: inertia(0.002) },
  })
  const of = (...jobs: object[]) =>
    newestInertia(...(jobs as unknown as Parameters<typeof newestInertia>))

  it('is that of the newest measurement', () => {
    expect(of(alone, tuning('2026-11-21T11:00:00Z'))?.inertia_kgm2).toBe(0.002)
    expect(of(alone, tuning('2026-11-21T09:00:00Z'))?.inertia_kgm2).toBe(0.001)
    // One that failed or still runs has none.
    expect(of({ ...alone, result: null }, tuning('2026-11-21T09:00:00Z'))?.inertia_kgm2).toBe(0.002)
  })
})
