// @vitest-environment happy-dom
import { shown } from '../../../testing/page'
import { screen } from '@testing-library/react'
import { expect, it } from 'vitest'
import type { DriveSummary } from '../../../api/schema'
import { setDrives } from '../../../live/store'
import { EMPTY } from './setup'
import { TriggerPanel } from './TriggerPanel'

it('shows the axis that its trigger names, also where that is gone', async () => {
  const names = ['Y', 'Z']
  setDrives(names.map((name) => ({ id: name.toLowerCase(), name }) as DriveSummary))
  await shown(
    <TriggerPanel
      choice={{ ...EMPTY.trigger, mode: 'single', kind: 'fault', drive: 'x' }}
      shown={[]}
      state={null}
      persistence={0}
      onChange={() => {}}
      onPersistence={() => {}}
      onArm={() => {}}
    />,
  )
  expect(screen.getByRole<HTMLSelectElement>('combobox', { name: 'Axis' }).value).toBe('x')
  expect(screen.getByText(/There is no axis x: the trigger is off/)).not.toBeNull()
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Arm' }).disabled).toBe(true)
})
