// @vitest-environment happy-dom
import '../../testing/page'
import { act, renderHook } from '@testing-library/react'
import { expect, it, vi } from 'vitest'
import { currentSession, keep as keepSession, mayHaveStop } from '../../app/people/session'
import { storedPlace, storePlace } from '../../app/tour/steps'
import type { Session } from '../../api/schema'
import { setLanguage } from '../../i18n'
import { subscribe } from '../../live/store'
import { useRemembered } from './remembered'
import { EMPTY, storedSetup, storeSetup } from '../../pages/scope/setup/setup'
import { setOriginal } from '../profile-text/texts'

const refuse = () => {
  throw new DOMException('refused', 'SecurityError')
}
vi.stubGlobal('localStorage', { getItem: refuse, setItem: refuse, removeItem: refuse })
vi.stubGlobal('sessionStorage', { getItem: refuse, setItem: refuse, removeItem: refuse })

it('opens a session, with STOP, in a browser that keeps nothing', () => {
  let reported = 0
  const end = subscribe('session', () => reported++)
  keepSession({ person: 'A', rights: [], csrf: null } as unknown as Session)
  end()
  expect([currentSession()?.person, reported]).toEqual(['A', 1])
  expect(mayHaveStop()).toBe(true)
})

it('takes numbers and choices in a browser that keeps nothing', () => {
  const { result } = renderHook(() => useRemembered('x', 'jog.speed', 60))
  expect(result.current[0]).toBe(60)
  act(() => result.current[1](30))
  expect(result.current[0]).toBe(30)
  expect(storedSetup()).toBeNull()
  for (const store of [
    () => storeSetup(EMPTY),
    () => storePlace('left'),
    () => setLanguage('en'),
    () => setOriginal(true),
  ]) {
    expect(store).not.toThrow()
  }
  expect(storedPlace()).toBe('offer')
})
