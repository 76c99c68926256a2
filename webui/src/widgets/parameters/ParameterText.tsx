import type { ParameterRow } from '../../api/schema'
import { href } from '../../app/navigation/router'
import { namedParameters } from './named-parameters'
import { ProfileText } from '../profile-text/ProfileText'
import { useRows } from '../profile-text/rows'

const NONE: ParameterRow[] = []

/** A text of the manual in which every parameter that it names leads to that parameter. */
export function ParameterText({ drive, text }: { drive: string; text: string }) {
  return (
    <ProfileText drive={drive} text={text} show={(said) => <Linked drive={drive} text={said} />} />
  )
}

function Linked({ drive, text }: { drive: string; text: string }) {
  const rows = useRows(drive) ?? NONE
  return namedParameters(text, rows).map((part, i) =>
    part.row === null ? (
      part.text
    ) : (
      <a key={i} href={href('parameters', drive, part.row.key)} title={part.row.name}>
        {part.text}
      </a>
    ),
  )
}
