import type { ReactNode } from 'react'

/** The tip of an arrow in a drawing; `id` is unique on the page. */
export function ArrowTip({ id }: { id: string }) {
  return (
    <defs>
      <marker
        id={id}
        viewBox="0 0 8 8"
        refX="7"
        refY="4"
        markerWidth="7"
        markerHeight="7"
        orient="auto"
      >
        <path d="M0 0 8 4 0 8z" className="tip" />
      </marker>
    </defs>
  )
}

/** A part of a drawing that is a button, by keyboard too. A key that is held presses it once. */
export function DrawnButton({
  className,
  label,
  busy = false,
  onPress,
  children,
}: {
  className: string
  label?: string
  busy?: boolean
  onPress: () => void
  children: ReactNode
}) {
  return (
    <g
      className={className}
      role="button"
      tabIndex={busy ? -1 : 0}
      aria-disabled={busy}
      aria-label={label}
      onClick={() => !busy && onPress()}
      onKeyDown={(event) => {
        if (busy || event.repeat || (event.key !== 'Enter' && event.key !== ' ')) return
        event.preventDefault()
        onPress()
      }}
    >
      {children}
    </g>
  )
}
