import { TextInput } from '@mantine/core'
import { useEffect, useRef, useState } from 'react'
import { useT } from '../../i18n'
import { faultOf, toNumber } from './number-text'

/** A number with its unit. Says at once what is wrong; `null` while it is not a valid number. */
export function NumberField({
  label,
  unit,
  value,
  onChange,
  onWrong,
  min,
  max,
  above,
  below,
  integer = false,
  optional = false,
  help,
  disabled = false,
}: {
  label: string
  unit?: string
  value: number | null
  onChange: (value: number | null) => void
  /**
   * Whether it holds something that is not allowed, and not just nothing. An optional field needs
   * it: its value is null in both cases.
   */
  onWrong?: (wrong: boolean) => void
  min?: number
  max?: number
  /** Exclusive lower limit. */
  above?: number
  /** Exclusive upper limit. */
  below?: number
  integer?: boolean
  optional?: boolean
  help?: string
  disabled?: boolean
}) {
  const t = useT()
  const [text, setText] = useState(value === null ? '' : String(value))
  const report = useRef(onWrong)
  report.current = onWrong
  /** The value that the text stands for. */
  const known = useRef(value)
  useEffect(() => {
    // A value set from elsewhere replaces the text; one's own typing is left as typed.
    if (value === known.current) return
    known.current = value
    if (value !== null && toNumber(text) === value) return
    setText(value === null ? '' : String(value))
    report.current?.(false)
  }, [value])
  // What was typed goes with the field.
  useEffect(() => () => report.current?.(false), [])
  // An empty form is not a mistake yet; a field that was emptied or left empty is.
  const [touched, setTouched] = useState(false)
  const bounds = { min, max, above, below, integer }
  const empty = text.trim() === ''
  const fault = empty ? null : faultOf(text, bounds)
  const problem = fault
    ? t(fault.key, 'limit' in fault ? { limit: fault.limit } : {})
    : empty && touched && !optional
      ? t('number.missing')
      : null
  return (
    <TextInput
      className="number-field"
      label={label}
      description={help}
      inputMode="decimal"
      disabled={disabled}
      placeholder={optional ? undefined : t('number.needed')}
      aria-required={!optional}
      onBlur={() => setTouched(true)}
      value={text}
      error={problem}
      rightSection={unit ? <span className="unit">{unit}</span> : null}
      rightSectionWidth={unit ? 20 + unit.length * 8 : 0}
      onChange={(event) => {
        setTouched(true)
        setText(event.currentTarget.value)
        const next = event.currentTarget.value
        const wrong = next.trim() !== '' && faultOf(next, bounds) !== null
        known.current = wrong ? null : toNumber(next)
        onChange(known.current)
        onWrong?.(wrong)
      }}
    />
  )
}
