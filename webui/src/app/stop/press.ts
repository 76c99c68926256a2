/** A finger or mouse button that went down, and on what. */
export interface Press<Thing> {
  /** What can be pressed there; null where nothing can. */
  on: Thing | null
  x: number
  y: number
}

/** A click comes within this time after the release, also that of a finger. */
const CLICK_MS = 700
/** Farther than this the pointer was moved on purpose: the press was called off. */
const STAYED_PX = 12

/**
 * What a click that follows `press` is to do. `pressed`: what can be pressed where the click came.
 *
 * A page may change between the press and the release: a notice comes, a list grows. A browser
 * then gives a mouse's click to nothing at all, and a finger's to whatever has come under it.
 */
export function meant<Thing>(
  press: Press<Thing> | null,
  pressed: Thing | null,
  x: number,
  y: number,
): 'as it is' | 'nothing' | 'what was pressed' {
  if (!press || press.on === pressed) return 'as it is'
  if (Math.hypot(x - press.x, y - press.y) > STAYED_PX) return pressed ? 'nothing' : 'as it is'
  return press.on === null ? 'nothing' : 'what was pressed'
}

const PRESSABLE =
  'button, a[href], label, summary, input, select, textarea, [role="button"], [role="option"]'

/** What a browser presses again with every repetition of a key that is held. */
const ONCE = 'button, a[href], summary, [role="button"]'

const pressable = (target: EventTarget | null) =>
  target instanceof Element ? target.closest<HTMLElement>(PRESSABLE) : null

/** Every press acts on what it began on, or on nothing. */
export function keepPresses(): void {
  let press: Press<HTMLElement> | null = null
  const down = (event: PointerEvent) => {
    press = event.isPrimary
      ? { on: pressable(event.target), x: event.clientX, y: event.clientY }
      : null
  }
  const up = () => {
    // A press that slid away has no click; the next one may come without a pointer.
    const ended = press
    setTimeout(() => {
      if (press === ended) press = null
    }, CLICK_MS)
  }
  const click = (event: MouseEvent) => {
    // Keys and scripts click without a place; what a label passes on comes after its own click.
    if (!event.isTrusted || event.detail === 0) return
    const begun = press
    press = null
    const act = meant(begun, pressable(event.target), event.clientX, event.clientY)
    if (act === 'as it is') return
    event.preventDefault()
    event.stopImmediatePropagation()
    if (act === 'what was pressed' && begun?.on?.isConnected) begun.on.click()
  }
  // A key that stays down repeats: what lies on a keyboard would start an axis again and again.
  const key = (event: KeyboardEvent) => {
    if (event.repeat && event.key === 'Enter' && pressable(event.target)?.matches(ONCE)) {
      event.preventDefault()
    }
  }
  window.addEventListener('keydown', key, { capture: true })
  window.addEventListener('pointerdown', down, { capture: true })
  window.addEventListener('pointerup', up, { capture: true })
  window.addEventListener('pointercancel', () => (press = null), { capture: true })
  window.addEventListener('click', click, { capture: true })
}
