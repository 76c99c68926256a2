import '@mantine/core/styles.css'
import './app/style.css'
import { StrictMode } from 'react'
import { createRoot } from 'react-dom/client'
import { App } from './app/App'
import { listenForEscape } from './app/stop'
import * as live from './live/live'

listenForEscape()
live.start()
createRoot(document.getElementById('root') as HTMLElement).render(
  <StrictMode>
    <App />
  </StrictMode>,
)
