import { Button, TextInput } from '@mantine/core'
import { type SyntheticEvent, useEffect, useRef, useState } from 'react'
import { api, ask } from '../../api/client'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { addChat, useChat } from '../../live/people'
import { useLink } from '../../live/store'
import { clock } from '../../widgets/numbers/format'
import { Panel } from '../../widgets/layout/Panel'

/** Lines for everybody on the station. */
export function ChatPanel() {
  const t = useT()
  const lines = useChat()
  const { open } = useLink()
  const [text, setText] = useState('')
  const end = useRef<HTMLDivElement>(null)
  useEffect(() => {
    if (!open) return
    void ask(api.GET('/api/v1/chat'))
      .then((log) => addChat(log.lines))
      .catch(() => {})
  }, [open])
  useEffect(() => {
    const list = end.current
    if (list) list.scrollTop = list.scrollHeight
  }, [lines])
  const say = (event: SyntheticEvent) => {
    event.preventDefault()
    const line = text.trim()
    if (line === '') return
    live.send({ type: 'chat', text: line })
    setText('')
  }
  return (
    <Panel title={t('chat.title')}>
      <div className="chat" ref={end} role="log" aria-label={t('chat.title')}>
        {lines.length === 0 && <p className="dim">{t('chat.none')}</p>}
        {lines.map((each) => (
          <p key={each.number}>
            <small className="dim num">{clock(each.time)}</small> <strong>{each.person}</strong>{' '}
            <span className="notes">{each.text}</span>
          </p>
        ))}
      </div>
      <form onSubmit={say} className="row">
        <TextInput
          className="grow"
          aria-label={t('chat.line')}
          placeholder={t('chat.line')}
          value={text}
          maxLength={500}
          autoComplete="off"
          onChange={(event) => setText(event.currentTarget.value)}
        />
        <Button type="submit" disabled={!open || text.trim() === ''}>
          {t('chat.send')}
        </Button>
      </form>
    </Panel>
  )
}
