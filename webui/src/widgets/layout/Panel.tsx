import type { ReactNode } from 'react'

/** A titled part of a page; `tools` stand at the right of the title. */
export function Panel({
  title,
  tools,
  children,
  className = '',
}: {
  title: ReactNode
  tools?: ReactNode
  children: ReactNode
  className?: string
}) {
  return (
    <section className={`panel ${className}`}>
      <header>
        <h2>{title}</h2>
        {tools && <div className="tools">{tools}</div>}
      </header>
      <div className="panel-body">{children}</div>
    </section>
  )
}
