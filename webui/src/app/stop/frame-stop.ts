import { stopEverything } from './stop'

/** Keys pressed in a frame do not come to the page; Esc must stop from there too. */
export function stopByEscapeIn(frame: HTMLIFrameElement | null): void {
  const stop = (event: KeyboardEvent) => {
    if (event.key === 'Escape' && !event.repeat) void stopEverything()
  }
  try {
    frame?.contentWindow?.addEventListener('keydown', stop, { capture: true })
  } catch {
    // The browser's own words for "no connection" are a foreign page, which takes no keys.
  }
}
