import { asked, serve } from '../../testing/bench'
import { createElement, useState } from 'react'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import { NumberField } from '../../widgets/NumberField'
import { type Drawn, Page, press, type } from '../../testing/render'
import { HealthPermission } from '../tune/health/HealthPermission'
import { complete } from '../tune/tools/ToolForm'
import { ImportPanel } from './ImportPanel'
import { SweepForm } from './SweepForm'

vi.mock('@mantine/core', () => import('../../testing/mantine'))
vi.mock('uplot', () => ({ default: class {} }))
vi.mock('../../app/session', () => ({ hasRight: () => true, useSession: () => null }))
vi.mock('../../widgets/useObstacle', () => ({ useObstacle: () => null }))

const field = (page: Page, label: string): Drawn => page.named('TextInput', label)

beforeEach(() => serve(() => 404))

describe('a number that may be left out', () => {
  it('is not left out where its text is no valid number', async () => {
    const seen: unknown[] = []
    function Field() {
      const [value, setValue] = useState<number | null>(null)
      seen.push(value)
      return createElement(NumberField, {
        label: 'Hz',
        value,
        onChange: setValue,
        onInvalid: () => setValue(Number.NaN),
        above: 0,
        optional: true,
      })
    }
    const page = new Page(createElement(Field))
    for (const text of ['1OO', '-', '-5', '1,5', '']) {
      await page.after(() => type(page.one('TextInput'), text))
      expect(page.one('TextInput').props.value).toBe(text)
    }
    expect(seen).toEqual([null, Number.NaN, Number.NaN, Number.NaN, 1.5, null])
  })

  it('keeps a measurement from being started', async () => {
    const way = { possible: true, bySpeed: false, cycleMs: 1 }
    const page = new Page(createElement(SweepForm, { drive: 'x', way }))
    const start = () => page.named('Button', 'Start measuring')
    expect(start().props['aria-disabled']).toBe(false)
    await page.after(() => type(field(page, 'To frequency'), '1OO'))
    expect(start().props['aria-disabled']).toBe(true)
    await page.after(() => type(field(page, 'To frequency'), ''))
    expect(start().props['aria-disabled']).toBe(false)
    // The lowest frequency, which was raised afterwards, counts as well.
    await page.after(() => type(field(page, 'To frequency'), '100'))
    await page.after(() => type(field(page, 'From frequency'), '50'))
    expect(start().props['aria-disabled']).toBe(true)
  })

  it('keeps a tool from being started', () => {
    const fields = [
      { name: 'a', type: 'number' as const, optional: true, limits: {}, initial: null },
    ]
    expect(complete(fields, { a: null })).toBe(true)
    expect(complete(fields, { a: Number.NaN })).toBe(false)
  })
})

describe('an import', () => {
  const column = (number: number, name: string) =>
    ({
      number,
      name,
      rises: number === 1,
      unit: '',
      low: 0,
      high: 1,
      first: [],
      curve: [],
    }) as unknown
  const found = {
    rows: 9,
    form: 'csv',
    columns: [column(1, 't'), column(2, 'iq'), column(3, 'speed')],
  }

  it('sends nothing of fields that are not there any more', async () => {
    serve(({ path }) => (path.includes('/preview') ? found : { file: 'a.sdmeas' }))
    const page = new Page(createElement(ImportPanel, { onStored: () => {} }))
    await page.after(() => press(page.one('FileButton'), 'onChange', new File(['1'], 'a.csv')))
    await page.after(() => type(page.named('NativeSelect', 'Time'), ''))
    await page.after(() => type(field(page, 'Sample rate'), '4000'))
    await page.after(() => type(page.named('NativeSelect', 'Time'), '1'))
    await page.after(() => press(page.named('Button', 'Evaluate and store')))
    expect(asked.at(-1)?.path).toContain('time=1')
    expect(asked.at(-1)?.path).not.toContain('sample_rate_hz')
  })
})

describe('a permission for runs without a person', () => {
  it('is not given with a pause that nobody typed', async () => {
    serve(({ method }) => (method === 'GET' ? null : 404))
    const page = new Page(createElement(HealthPermission, { drive: 'x', job: null }))
    const give = () => page.all('Button').at(-1)!
    await page.after(() => press(page.all('Checkbox')[0]!, 'onChange'))
    await page.after(() =>
      press(page.all('Checkbox').at(-1)!, 'onChange', { currentTarget: { checked: true } }),
    )
    expect(give().props.disabled).toBe(false)
    await page.after(() => type(page.all('TextInput')[2]!, '1O'))
    expect(give().props.disabled).toBe(true)
  })
})
