// @vitest-environment happy-dom
import { refusal, sent, serve, settled, shown, type } from '../../../testing/page'
import { fireEvent, screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { beforeEach, describe, expect, it, vi } from 'vitest'
import type { LibraryEntry } from '../../../api/schema'
import { EntryDetails } from './EntryDetails'

const entry = { id: 7, kind: 'report', versions: 1, notes: 'old', tags: ['a'] } as LibraryEntry
let now = 'theirs'
const changed = vi.fn()
const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))
const notes = () => screen.getByRole<HTMLTextAreaElement>('textbox', { name: 'Notes' })

beforeEach(async () => {
  now = 'theirs'
  changed.mockClear()
  serve(({ method, body }) => {
    const change = body as { notes: string; base_notes: string } | null
    if (method !== 'PATCH' || !change) return 404
    return change.base_notes === now
      ? { ...entry, notes: change.notes }
      : refusal(409, {
          type: 'urn:servodeck:changed-meanwhile',
          parameter: 'notes',
          value: now,
        })
  })
  const page = await shown(<EntryDetails entry={entry} onCompare={() => {}} onChanged={changed} />)
  const details = page.container.querySelector('details')!
  await settled(() => {
    details.open = true
    fireEvent(details, new Event('toggle'))
  })
  await type(notes(), 'mine')
  await press('Save tags and notes')
  await settled()
})

describe('notes that another person changed meanwhile', () => {
  it('are not overwritten, and both texts are kept', () => {
    expect(sent('/library/7')?.body).toEqual({
      notes: 'mine', tags: ['a'], base_notes: 'old', base_tags: ['a'],
    }) // prettier-ignore
    expect(changed).not.toHaveBeenCalled()
    expect(screen.getByRole('alert').textContent).toContain('theirs')
    expect(notes().value).toBe('mine')
  })

  it('are replaced only where a person wants it, and only the text that was shown', async () => {
    now = 'a third one'
    await press('Save mine in its place')
    await settled()
    expect(changed).not.toHaveBeenCalled()
    expect(screen.getByRole('alert').textContent).toContain('a third one')
    await press('Save mine in its place')
    await settled()
    expect(sent('/library/7')?.body).toMatchObject({ notes: 'mine', base_notes: 'a third one' })
    expect(changed).toHaveBeenCalledTimes(1)
    expect(screen.queryByRole('alert')).toBeNull()
  })

  it('can be taken in place of the own ones', async () => {
    await press('Take the other text')
    expect(notes().value).toBe('theirs')
    expect(screen.queryByRole('alert')).toBeNull()
    await press('Save tags and notes')
    await settled()
    expect(sent('/library/7')?.body).toMatchObject({ notes: 'theirs', base_notes: 'theirs' })
    expect(changed).toHaveBeenCalledTimes(1)
  })
})
