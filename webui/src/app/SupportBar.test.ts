import { posted } from '../testing/browser'
import { beforeEach, expect, it } from 'vitest'
import type { InvitationView } from '../api/schema'
import { publish } from '../live/store'
import { inside, Shallow } from '../testing/shallow'
import { SupportBar } from './SupportBar'
import { people } from '../live/people'

const INVITATION = {
  id: 'i',
  guest: 'Guest',
  state: 'joined',
  enabled: false,
  grant: { rights: ['motion'], drive: null, until: '2026-01-01T00:00:00Z' },
} as unknown as InvitationView

beforeEach(() => {
  posted.splice(0)
  people.here = { people: [], invitations: [INVITATION] } as unknown as typeof people.here
})

function button() {
  const bar = new Shallow(SupportBar, {})
  const host = inside(bar.the('AsHost'))
  const enabling = inside(host.the('EnablingButton'))
  const event = (kind: string, what: object) =>
    enabling.act(() => {
      const heard = enabling.the('button').props[kind] as ((event: unknown) => void) | undefined
      heard?.({ pointerId: 1, currentTarget: { setPointerCapture: () => {} }, ...what })
    })
  return { enabling, event }
}
const kinds = () => posted.map((each) => (each as { kind: string }).kind)
const held = (enabling: ReturnType<typeof button>['enabling']) =>
  enabling.the('button').props['aria-pressed']

it('lets go when its mouse button does, also while another one is held down', async () => {
  const { enabling, event } = button()
  await event('onPointerDown', { button: 0, buttons: 1 })
  expect(held(enabling)).toBe(true)
  await event('onPointerMove', { button: 2, buttons: 3 })
  expect(held(enabling)).toBe(true)
  await event('onPointerMove', { button: 0, buttons: 2 })
  expect(held(enabling)).toBe(false)
  expect(kinds()).toContain('enableRelease')
})

it('is not shown as held once the worker has ended it', async () => {
  const { enabling, event } = button()
  await event('onPointerDown', { button: 0, buttons: 1 })
  await enabling.act(() => publish('enableEnded'))
  expect(held(enabling)).toBe(false)
})
