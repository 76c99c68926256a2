// @vitest-environment happy-dom
import { asked, serve, settled, shown, type } from '../../../testing/page'
import { fireEvent, screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { useState } from 'react'
import { beforeEach, describe, expect, it } from 'vitest'
import { keep as keepSession } from '../../../app/people/session'
import type { AxisState, Session, ToolInfo } from '../../../api/schema'
import { contents } from '../../../live/store'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { useWrong } from '../../../widgets/numbers/useWrong'
import { AutotunePanel } from '../../tune/autotune/AutotunePanel'
import { HealthPermission } from '../../tune/health/HealthPermission'
import { InertiaPanel } from '../../tune/steps/InertiaPanel'
import { MeasuredStart, ToolPanel, useToolRun } from '../../tune/tools/form/ToolPanel'
import { ImportPanel } from '../imported/ImportPanel'
import { SweepForm } from './SweepForm'

const LIMITS = {
  travel_limit: 3,
  speed_limit: 1200,
  torque_limit: 80,
  time_limit_s: 60,
  consent: false,
}
const MEASURED = { drive: 'x', limits: LIMITS, obstacle: null, cycleMs: 1 }
const STATE = { drive: 'x', fresh: true, moving_job: null, units: {} } as unknown as AxisState
const OBSTACLE = 'A field above is empty or holds a value that is not allowed. Fill it in.'

const field = (name: string) => screen.getByRole<HTMLInputElement>('textbox', { name })
const button = (name: string) => screen.getByRole<HTMLButtonElement>('button', { name })

beforeEach(() => {
  contents.link = { open: true, attempt: 0, roundTripMs: null }
  contents.states.set('x', STATE)
  keepSession({ person: 'A', rights: ['motion', 'measure'], csrf: null } as unknown as Session)
  serve(() => 404)
})

/** A start is refused, with the obstacle, and not tried, as long as a field holds `1OO`. */
async function refusesWhileInvalid(name: string, start: string, job: string, number = '100') {
  const begun = () => asked.some(({ method, path }) => method === 'POST' && path.endsWith(job))
  expect(button(start).getAttribute('aria-disabled')).toBe('false')
  await type(field(name), '1OO')
  expect(button(start).getAttribute('aria-disabled')).toBe('true')
  await userEvent.click(button(start))
  expect(screen.getByText(OBSTACLE, { exact: false })).toBeDefined()
  for (const text of ['', number]) {
    await type(field(name), text)
    expect(button(start).getAttribute('aria-disabled'), text).toBe('false')
    await type(field(name), '-')
    expect(button(start).getAttribute('aria-disabled')).toBe('true')
  }
  expect(begun()).toBe(false)
  await type(field(name), '')
  await userEvent.click(button(start))
  await settled()
  expect(begun()).toBe(true)
}

describe('a number that may be left out', () => {
  it('is not left out where its text is no valid number', async () => {
    const seen: unknown[] = []
    function Field() {
      const [value, setValue] = useState<number | null>(null)
      const wrong = useWrong()
      const now = [value, wrong.any]
      if (JSON.stringify(now) !== JSON.stringify(seen.at(-1))) seen.push(now)
      return (
        <NumberField
          label="Hz"
          value={value}
          onChange={setValue}
          onWrong={wrong.of('hz')}
          above={0}
          optional
        />
      )
    }
    await shown(<Field />)
    for (const text of ['1OO', '-', '-5', '1,5', '']) {
      fireEvent.change(field('Hz'), { target: { value: text } })
      expect(field('Hz').value).toBe(text)
    }
    expect(seen).toEqual([
      [null, false],
      [null, true],
      [1.5, false],
      [null, false],
    ])
  })

  it('shows no text of a value that was taken away from elsewhere', async () => {
    const at = (value: number | null) => (
      <NumberField label="Hz" value={value} onChange={() => {}} optional />
    )
    const page = await shown(at(5))
    expect(field('Hz').value).toBe('5')
    page.rerender(at(null))
    expect(field('Hz').value).toBe('')
    page.rerender(at(7))
    expect(field('Hz').value).toBe('7')
  })

  it('keeps a measurement from being started', async () => {
    const way = { possible: true, bySpeed: false, cycleMs: 1 }
    await shown(<SweepForm drive="x" way={way} />)
    await userEvent.click(screen.getByText('Excitation', { selector: 'summary' }))
    await refusesWhileInvalid('To frequency', 'Start measuring', '/jobs/sweep')
    // The lowest frequency, which was raised afterwards, counts as well.
    await type(field('To frequency'), '100')
    await type(field('From frequency'), '50')
    expect(button('Start measuring').getAttribute('aria-disabled')).toBe('true')
  })

  it('keeps a tool from being started', async () => {
    const number = { anyOf: [{ type: 'number' }, { type: 'null' }], default: null }
    const tool = {
      kind: 'friction',
      texts: { 'field.a': ['Optional', ''], start: ['Start', ''] },
      settings: { properties: { a: number } },
    } as unknown as ToolInfo
    serve(({ path }) => (path === '/tools' ? [tool] : 404))
    function Panel() {
      const run = useToolRun('friction', 'x')
      return (
        <ToolPanel run={run} answer={null}>
          <MeasuredStart run={run} measured={MEASURED} />
        </ToolPanel>
      )
    }
    await shown(<Panel />)
    await refusesWhileInvalid('Optional', 'Start', '/jobs/friction')
    expect(asked.at(-1)?.body).toMatchObject({ a: null })
  })

  it('keeps a tuning and a measurement of the inertia from being started', async () => {
    const tuning = await shown(
      <AutotunePanel {...MEASURED} state={STATE} now={null} onChanged={() => {}} />,
    )
    await refusesWhileInvalid('Motor inertia', 'Start tuning', '/jobs/autotune', '0.001')
    tuning.unmount()
    await shown(<InertiaPanel {...MEASURED} state={STATE} />)
    await refusesWhileInvalid('Motor inertia', 'Measure the inertia', '/jobs/inertia', '0.001')
  })
})

describe('an import', () => {
  const column = (number: number, name: string) => ({
    number,
    name,
    rises: number === 1,
    unit: '',
    low: 0,
    high: 1,
    first: [],
    curve: [],
  })
  const found = {
    rows: 9,
    form: 'csv',
    columns: [column(1, 't'), column(2, 'iq'), column(3, 'speed')],
  }
  const choose = (label: string, option: string) =>
    userEvent.selectOptions(screen.getByRole('combobox', { name: label }), option)
  const opened = async () => {
    serve(({ path }) => (path.includes('/preview') ? found : { file: 'a.sdmeas' }))
    const { container } = await shown(<ImportPanel onStored={() => {}} />)
    const file = container.querySelector<HTMLInputElement>('input[type=file]')!
    await userEvent.upload(file, new File(['1'], 'a.csv'))
    await settled()
  }

  it('sends nothing of fields that are not there any more', async () => {
    await opened()
    await choose('Time', 'none: by sample rate')
    await type(field('Sample rate'), '4000')
    await choose('Time', '1 t')
    await userEvent.click(button('Evaluate and store'))
    await settled()
    expect(asked.at(-1)?.path).toContain('time=1')
    expect(asked.at(-1)?.path).not.toContain('sample_rate_hz')
  })

  it('is not evaluated while a field of it holds no valid number', async () => {
    await opened()
    await choose('Unit of the input', 'A')
    expect(button('Evaluate and store').disabled).toBe(false)
    await type(field('Torque constant'), '0,1O')
    expect(button('Evaluate and store').disabled).toBe(true)
    // What was typed goes with its field.
    await choose('Unit of the input', 'Nm')
    expect(button('Evaluate and store').disabled).toBe(false)
    // And a number goes with the unit that it was typed for.
    await choose('Unit of the input', 'A')
    await type(field('Torque constant'), '0.1')
    await choose('Unit of the input', 'mA')
    expect(field('Torque constant').value).toBe('')
    await userEvent.click(button('Evaluate and store'))
    await settled()
    expect(asked.at(-1)?.path).not.toContain('torque_constant_nm_a')
  })
})

describe('a permission for runs without a person', () => {
  it('is not given with a pause that nobody typed', async () => {
    serve(({ method }) => (method === 'GET' ? null : 404))
    await shown(<HealthPermission drive="x" job={null} />)
    await userEvent.click(screen.getByText('Without a person: schedule and controller'))
    await userEvent.click(screen.getByRole('checkbox', { name: 'Mon' }))
    await userEvent.click(
      screen.getByRole('checkbox', { name: /Nobody can be in the danger zone/ }),
    )
    expect(button('Permit').disabled).toBe(false)
    await type(field('Least time between two runs (min)'), '1O')
    expect(button('Permit').disabled).toBe(true)
  })
})
