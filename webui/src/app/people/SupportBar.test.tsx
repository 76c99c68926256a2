// @vitest-environment happy-dom
import { posted, settled, shown } from '../../testing/page'
import { fireEvent, screen } from '@testing-library/react'
import { beforeEach, expect, it } from 'vitest'
import type { InvitationView } from '../../api/schema'
import { people } from '../../live/people'
import { publish } from '../../live/store'
import { SupportBar } from './SupportBar'

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

const kinds = () => posted.map(({ kind }) => kind)
const pressed = (button: HTMLElement) => button.getAttribute('aria-pressed')
async function enabling() {
  await shown(<SupportBar />)
  return screen.getByRole('button', { name: 'Hold to let it move' })
}

it('lets go when its mouse button does, also while another one is held down', async () => {
  const button = await enabling()
  fireEvent.pointerDown(button, { pointerId: 1, button: 0, buttons: 1 })
  expect(pressed(button)).toBe('true')
  fireEvent.pointerMove(button, { pointerId: 1, button: 2, buttons: 3 })
  expect(pressed(button)).toBe('true')
  expect(kinds()).not.toContain('enableRelease')
  fireEvent.pointerMove(button, { pointerId: 1, button: 0, buttons: 2 })
  expect(pressed(button)).toBe('false')
  expect(kinds()).toContain('enableRelease')
})

it('is not shown as held once the worker has ended it', async () => {
  const button = await enabling()
  fireEvent.pointerDown(button, { pointerId: 1, button: 0, buttons: 1 })
  expect(pressed(button)).toBe('true')
  await settled(() => publish('enableEnded'))
  expect(pressed(button)).toBe('false')
})
