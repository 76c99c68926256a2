// @vitest-environment happy-dom
import { serve, settled, shown } from '../../../testing/page'
import { screen } from '@testing-library/react'
import { userEvent } from '@testing-library/user-event'
import { expect, it } from 'vitest'
import { useListDownload } from './ListDownload'

function Downloads() {
  const { buttons, note } = useListDownload('a.sdset')
  return (
    <>
      {buttons}
      {note}
    </>
  )
}

it('names each row that a DCF cannot hold, with its reason', async () => {
  const row = {
    key: 'PA_38',
    reason: 'only Modbus reaches it',
    reason_message: { code: 'sets.left-out-no-object', params: {} },
  }
  serve(({ path }) =>
    path === '/sets/a.sdset/list/left-out?format=dcf'
      ? [row]
      : path.includes('left-out')
        ? []
        : 404,
  )
  await shown(<Downloads />)
  // The link itself is followed by the browser.
  document.addEventListener('click', (event) => event.preventDefault())
  await userEvent.click(screen.getByRole('link', { name: 'a.sdset as CSV' }))
  await settled()
  expect(screen.queryByRole('status')).toBeNull()
  await userEvent.click(screen.getByRole('link', { name: 'a.sdset as DCF' }))
  const note = await screen.findByRole('status')
  expect(note.textContent).toContain('1 row is not in the DCF file')
  expect(note.textContent).toContain('PA_38 only Modbus reaches it')
})
