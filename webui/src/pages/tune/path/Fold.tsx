import { type ReactNode, useState } from 'react'
import { useT } from '../../../i18n'
import { Icon } from '../../../widgets/layout/Icon'
import type { Section, useSections } from './sections'

/**
 * One step of the path under its title, which opens and folds it; what was typed stays. What was
 * never open is not drawn: values of the axis come many times a second, and draw all forms again.
 */
export function Fold({
  of,
  name,
  title,
  number,
  state,
  help,
  children,
}: {
  of: ReturnType<typeof useSections>
  name: Section
  title: string
  /** Its number in the one sequence of tuning. */
  number?: number
  /** Whether it is done, is the next one or open; left out where it is no step. */
  state?: 'done' | 'next' | 'open'
  /** What it is for, in a few words that stand also while it is folded. */
  help?: string
  children: ReactNode
}) {
  const t = useT()
  const open = of.isOpen(name)
  const [seen, setSeen] = useState(open)
  if (open && !seen) setSeen(true)
  return (
    <details
      id={`step-${name}`}
      className={`fold ${state ?? ''}`}
      open={open}
      onToggle={(event) => {
        if (event.target !== event.currentTarget) return
        if (event.currentTarget.open !== open) of.set(name, event.currentTarget.open)
      }}
    >
      <summary>
        <h2>
          {number !== undefined && <span className="fold-number">{number}</span>} {title}
        </h2>
        {help && <small className="dim">{help}</small>}
        {state && (
          <small className="fold-state">
            {state === 'done' && <Icon name="check" size={16} />}
            {t(`path.${state}`)}
          </small>
        )}
      </summary>
      <div className="stack">{seen && children}</div>
    </details>
  )
}
