/** What can have the keyboard, and whether it can have it now. */
export const takes = (element: HTMLElement | null): element is HTMLElement =>
  element !== null &&
  element.isConnected &&
  !element.matches(':disabled') &&
  element.getClientRects().length > 0

/**
 * The keyboard stays where it was. A browser drops it where its button is disabled while a request
 * runs, and where a dialogue closes: whoever works without a mouse would have to go through the
 * whole page again. `inside`: what had it last; `outside`: what had it last outside of dialogues.
 */
export function keepFocus(): void {
  let inside: HTMLElement | null = null
  let outside: HTMLElement | null = null
  const giveBack = () => {
    const now = document.activeElement
    if ((now !== null && now !== document.body) || (!inside && !outside)) return
    const to = [inside, outside].find(takes)
    to?.focus({ preventScroll: true })
  }
  window.addEventListener('focusin', ({ target }) => {
    if (!(target instanceof HTMLElement)) return
    inside = target
    if (!target.closest('[role="dialog"]')) outside = target
  })
  // A press outside everything lets it go; a press on something gives it to that.
  window.addEventListener('pointerdown', () => (inside = outside = null), { capture: true })
  new MutationObserver(giveBack).observe(document.body, {
    subtree: true,
    childList: true,
    attributeFilter: ['disabled'],
  })
}
