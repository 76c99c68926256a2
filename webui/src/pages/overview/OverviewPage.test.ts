import '../../testing/browser'
import { expect, it, vi } from 'vitest'
import type { AxisState } from '../../api/schema'
import { setState } from '../../live/store'
import { Shallow } from '../../testing/shallow'
import { OverviewPage } from './OverviewPage'

vi.mock('./SceneHere', () => ({ SceneHere: () => null }))

const state = (time: string, fresh: boolean, faults: object[]) =>
  ({
    drive: 'x',
    time,
    fresh,
    faults,
    state: 'Fault',
    goals: [],
    units: {},
  }) as unknown as AxisState

it('calls no axis free of faults that does not answer', async () => {
  setState(state('2026-01-01T00:00:00Z', true, [{ code: '1', name: 'a' }]))
  const page = new Shallow(OverviewPage, { drive: 'x' })
  await page.act(() => setState(state('2026-01-01T00:00:01Z', true, [])))
  expect(page.text).toContain('No fault is active')
  await page.act(() => setState(state('2026-01-01T00:00:02Z', false, [])))
  expect(page.text).not.toContain('No fault is active')
  expect(page.the('FaultResetButton').props.disabled).toBe(true)
})
