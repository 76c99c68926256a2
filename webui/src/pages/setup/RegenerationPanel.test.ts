import { answers } from '../../testing/browser'
import { expect, it, vi } from 'vitest'
import type { BrakingInfo } from '../../api/schema'
import { Shallow } from '../../testing/shallow'
import { RegenerationPanel } from './RegenerationPanel'

vi.mock('../response/useGains', () => ({ useGains: () => ({ gains: null }) }))

const RESULT = { verdict: 'capacitor' } as BrakingInfo

it('shows no verdict on what stood in the form when it was asked for', async () => {
  const release: (() => void)[] = []
  answers.push({
    method: 'POST',
    path: /calculate\/braking$/,
    give: () => new Promise((done) => release.push(() => done(RESULT))),
  })
  const panel = new Shallow(RegenerationPanel, { drive: 'x', regen: null })
  await panel.act()
  const type = (label: string, value: number) =>
    panel.act(() => {
      const field = panel.the('NumberField', (props) => props.label === label)
      ;(field.props.onChange as (value: number) => void)(value)
    })
  const calculate = () =>
    panel.act(
      panel.the('Button', (props) => props.variant === 'filled').props.onClick as () => void,
    )
  await type('Inertia of motor and load', 0.001)
  await calculate()
  await panel.act(() => release[0]?.())
  expect(panel.has('Result')).toBe(true)
  await calculate()
  await type('Inertia of motor and load', 0.1)
  await panel.act(() => release[1]?.())
  expect(panel.has('Result')).toBe(false)
})
