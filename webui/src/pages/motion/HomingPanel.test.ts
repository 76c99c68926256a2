import { answers, requests } from '../../testing/browser'
import { beforeEach, expect, it } from 'vitest'
import type { AxisState, HomingMethodInfo } from '../../api/schema'
import { contents } from '../../live/store'
import { inside, Shallow } from '../../testing/shallow'
import { HomingPanel } from './HomingPanel'
import { travelUnit } from './travelUnit'

const METHOD = { method: 1, name: 'Limit switch', help: '', notes: '', source: '' }
const STATE = {
  drive: 'x',
  time: '2026-01-01T00:00:00Z',
  fresh: true,
  moving_job: null,
  units: { position: 'rev', velocity: 'rpm', acceleration: 'rpm/s' },
} as unknown as AxisState

beforeEach(() => {
  contents.link = { open: true, attempt: 0, roundTripMs: null }
  contents.states.set('x', STATE)
  answers.splice(0)
  requests.splice(0)
  answers.push(
    { method: 'GET', path: /homing-methods$/, give: () => [METHOD as HomingMethodInfo] },
    { method: 'POST', path: /jobs\/home$/, give: () => ({ id: 'j', state: 'running' }) },
  )
})

async function opened() {
  const unit = travelUnit('rev', null, STATE)
  const panel = new Shallow(HomingPanel, { drive: 'x', unit, onStarted: () => {} })
  await panel.act()
  const type = (label: string, text: string) =>
    panel.act(() => {
      const speed = panel.the('Speed', (props) => props.label === label)
      const field = inside(inside(speed).the('NumberField'))
      ;(field.the('TextInput').props.onChange as (event: unknown) => void)({
        currentTarget: { value: text },
      })
    })
  const start = () => panel.the('StartButton').props
  return { panel, type, start }
}

it('starts no homing while an optional speed is not a number', async () => {
  const { panel, type, start } = await opened()
  expect(start().obstacle).toBeNull()
  for (const text of ['1o0', '-', '0', '1e400']) {
    await type('Speed during search for switch', text)
    expect(start().obstacle, text).toContain('not allowed')
  }
  await type('Speed during search for switch', '')
  expect(start().obstacle).toBeNull()
  await type('Speed during search for switch', '100')
  expect(start().obstacle).toBeNull()
  await panel.act(start().onStart as () => void)
  expect(await requests.at(-1)?.json()).toMatchObject({ speed_switch: 100, speed_zero: null })
})
