// @vitest-environment happy-dom
import { asked, refusal, serve, settled, shown } from '../../testing/page'
import { cleanup, screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it } from 'vitest'
import type { ForcingInfo, JobInfo } from '../../api/schema'
import { setJob } from '../../live/store'
import { ForcingPanel } from './ForcingPanel'

const forcing = {
  name: 'outputs',
  title: 'Force outputs',
  help: '',
  warning: 'Parts may move.',
  notes: '',
  source: 'manual',
  terminals: ['DO1'],
  two_way: true,
  running: false,
  values: {},
  job: null,
} as unknown as ForcingInfo
let number = 0
let job = ''
let ends: () => object | number = () => ({})
const state = (part: Partial<JobInfo>) =>
  settled(() =>
    setJob({
      id: job, kind: 'forcing', drive: 'x', title: '', state: 'running', progress: 0, step: '',
      ended: null, result: null, problem: null, ...part,
    } as unknown as JobInfo),
  ) // prettier-ignore
const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))
const count = (method: string) => asked.filter((each) => each.method === method).length
const running = () => screen.queryByText(/^Terminals are forced/)
const notEnded = () => screen.queryByText(/terminals may still be forced/)

beforeEach(async () => {
  job = `j${(number += 1)}`
  ends = () => forcing
  serve(({ method }) => (method === 'DELETE' ? ends() : { ...forcing, running: true, job }))
  await shown(<ForcingPanel drive="x" forcing={forcing} onChanged={() => {}} />)
  await userEvent.click(screen.getByRole('checkbox'))
  await press('Begin')
  await settled()
  await state({})
  expect(running()).not.toBeNull()
})

describe('the end of forcing', () => {
  it('is shown as not confirmed where it was refused, and can be asked for again', async () => {
    ends = () => refusal(500, { detail: 'DO1 was not restored' })
    await press('End and restore')
    await settled()
    expect(notEnded()).not.toBeNull()
    expect(screen.getByText(/DO1 was not restored/)).not.toBeNull()
    // No sign of life any more: the server ends it by itself.
    const alive = count('PUT')
    await new Promise((resolve) => setTimeout(resolve, 1500))
    expect(count('PUT')).toBe(alive)
    ends = () => forcing
    await press('End and restore')
    await settled()
    expect([notEnded(), running()]).toEqual([null, null])
    expect(count('DELETE')).toBe(2)
  })

  it('shows what the job could not restore, also after its end', async () => {
    await press('End and restore')
    await settled()
    const problem = refusal(500, { detail: '60FE:02 stays at 1' })
    await state({ state: 'failed', ended: '2026-11-28T00:00:00Z', problem })
    expect(screen.getByText(/60FE:02 stays at 1/)).not.toBeNull()
  })

  it('comes with leaving the page', async () => {
    expect(count('DELETE')).toBe(0)
    cleanup()
    await settled()
    expect(count('DELETE')).toBe(1)
  })
})
