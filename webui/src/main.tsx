import './app/styles/library-styles'
import './app/styles/style.css'
import './app/people/people.css'
import { StrictMode } from 'react'
import { createRoot } from 'react-dom/client'
import { whenUnknown } from './api/client'
import { App } from './app/App'
import { keepFocus } from './app/focus'
import { keepPresses } from './app/stop/press'
import { checkSession } from './app/people/session'
import { listenForAnswers, listenForEscape } from './app/stop/stop'
import * as live from './live/live'

listenForEscape()
listenForAnswers()
keepPresses()
keepFocus()
whenUnknown(() => void checkSession())
live.whenRefused(() => void checkSession())
createRoot(document.getElementById('root') as HTMLElement).render(
  <StrictMode>
    <App />
  </StrictMode>,
)
