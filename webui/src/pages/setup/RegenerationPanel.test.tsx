// @vitest-environment happy-dom
import { serve, settled, shown, type } from '../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { expect, it, vi } from 'vitest'
import type { BrakingInfo } from '../../api/schema'
import { RegenerationPanel } from './RegenerationPanel'

vi.mock('../response/design/useGains', () => ({ useGains: () => ({ gains: null }) }))

const RESULT = { verdict: 'capacitor' } as BrakingInfo
const VERDICT = 'The capacitors of the DC bus absorb all of it. No resistor is needed.'

it('shows no verdict on what stood in the form when it was asked for', async () => {
  const release: (() => void)[] = []
  serve(() => new Promise((done) => release.push(() => done(RESULT))))
  await shown(<RegenerationPanel drive="x" regen={null} />)
  const inertia = screen.getByRole('textbox', { name: 'Inertia of motor and load' })
  const calculate = () => userEvent.click(screen.getByRole('button', { name: 'Calculate' }))
  await type(inertia, '0.001')
  await calculate()
  await settled(() => release[0]?.())
  expect(screen.queryByText(VERDICT)).not.toBeNull()
  await calculate()
  await type(inertia, '0.1')
  await settled(() => release[1]?.())
  expect(release).toHaveLength(2)
  expect(screen.queryByText(VERDICT)).toBeNull()
})
