// @vitest-environment happy-dom
import { settled, shown } from '../../testing/page'
import { screen } from '@testing-library/react'
import { expect, it, vi } from 'vitest'
import type { AxisState } from '../../api/schema'
import { setState } from '../../live/store'
import { OverviewPage } from './OverviewPage'

vi.mock('./SceneHere', () => ({ SceneHere: () => null }))

const FAULT = { code: '1', name: 'a', kind: 'fault', causes: [], remedies: [] }
const state = (time: string, fresh: boolean, faults: object[]) =>
  ({
    drive: 'x',
    time,
    fresh,
    faults,
    state: 'Fault',
    goals: [],
    units: {},
    mode_bits: {},
    status_word: null,
    blocked_by: [],
  }) as unknown as AxisState

it('calls no axis free of faults that does not answer', async () => {
  setState(state('2026-01-01T00:00:00Z', true, [FAULT]))
  await shown(<OverviewPage drive="x" />)
  expect(screen.getByRole('button', { name: 'Reset faults' })).toHaveProperty('disabled', false)
  await settled(() => setState(state('2026-01-01T00:00:01Z', true, [])))
  expect(screen.queryByText('No fault is active.')).not.toBeNull()
  await settled(() => setState(state('2026-01-01T00:00:02Z', false, [])))
  expect(screen.queryByText('No fault is active.')).toBeNull()
  expect(screen.getByRole('button', { name: 'Reset faults' })).toHaveProperty('disabled', true)
})
