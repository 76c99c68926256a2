import { type CSSProperties } from 'react'

/** Names of curves next to their lines, for plots without a legend of their own. */
export function Legend({ of }: { of: { label: string; color: string; dashed?: boolean }[] }) {
  return (
    <ul className="legend">
      {of.map((each) => (
        <li key={each.label}>
          <span
            className={each.dashed ? 'line dashed' : 'line'}
            style={{ '--curve': each.color } as CSSProperties}
          />
          {each.label}
        </li>
      ))}
    </ul>
  )
}
