import { useState } from 'react'

export interface Wrong {
  any: boolean
  of: (field: string) => (wrong: boolean) => void
}

/**
 * The fields of a form that hold something that is not allowed. An optional field has no value
 * then, as when it is empty; a form that sent that would do something else than what was typed.
 */
export function useWrong(): Wrong {
  const [fields, setFields] = useState<readonly string[]>([])
  return {
    any: fields.length > 0,
    of: (field) => (wrong) =>
      setFields((old) =>
        old.includes(field) === wrong
          ? old
          : wrong
            ? [...old, field]
            : old.filter((each) => each !== field),
      ),
  }
}
